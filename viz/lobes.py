"""Lobes as surfaces: a fit on its mesh, or measured values joined by straight triangles.

Every lobe first finds its values (`evaluate`), so that all lobes of a picture can agree on one scale, and
then takes its shape (`draw`). Points, normals and colours are written in place: while a slider moves, only
numbers change.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.opencl.device import Device
from clbrdf.viz.curves import seen_along
from clbrdf.viz.directions import unit_vectors
from clbrdf.viz.evaluator import mesh_evaluator
from clbrdf.viz.joined import joined_directions
from clbrdf.viz.mesh import LobeMesh, whole
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.subject import Subject

Single = npt.NDArray[np.float32]
Colours = npt.NDArray[np.uint8]
Paint = Callable[[npt.NDArray[np.floating]], Colours]
"""From values (...) to colours (..., 3)."""


MARGIN = 1.0
"""Degrees beyond the largest view zenith measured that do not count as extrapolated yet."""
CUT_OFF = 1.13
"""Longest radius of an extrapolation; 1 is the top of the scale."""
EXTRAPOLATED = np.array([154.0, 160.0, 168.0])
"""Grey, 8 bits."""


class Lobe(Protocol):
    """One surface of a picture."""

    polydata: Any
    outline: Any
    """The surface's curve in the plane of incidence, drawn as a line: it is seen where the lobe itself is
    narrower than a pixel. None where there is no such curve."""
    net: Any
    """Lines that stand for the surface where several are laid over each other; None where there are none."""

    def evaluate(self, column: int, theta_i: float) -> bool:
        """Find the values at a wavelength and an incident zenith; False where there are none."""

    def held_by_data(self) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]]:
        """Values and cosines of the view zenith, (K,), as far as something was measured, for the scale."""

    @property
    def values(self) -> npt.NDArray[np.floating]:
        """Values of the last `evaluate`, 1/sr; differences are signed."""

    @property
    def cos_r(self) -> npt.NDArray[np.floating]:
        """Cosine of the view zenith of every value."""

    @property
    def vectors(self) -> npt.NDArray[np.floating]:
        """Unit vectors of all values, (..., 3)."""

    def spectra(self) -> npt.NDArray[np.float64]:
        """Values at every wavelength, (..., W)."""

    def draw(self, scale: RadiusScale, paint: Paint | None) -> None:
        """Give the surface the lengths of a scale; None leaves the colours as they are."""

    def set_colours(self, colours: Colours) -> None:
        """Set the colours of all values, (..., 3)."""


class FittedLobe:
    """The model on a mesh; with `other`, the difference self − other of two models.

    Parameters
    ----------
    subject : Subject
        With a fit.
    mesh : LobeMesh
    device : Device, optional
    other : Subject, optional
        With a fit: what is subtracted, at its wavelength nearest to that of `subject`.
    """

    def __init__(
        self, subject: Subject, mesh: LobeMesh, device: Device | None = None, other: Subject | None = None
    ) -> None:
        import pyvista as pv

        assert subject.fit is not None
        self.subject, self.other, self.mesh = subject, other, mesh
        self._evaluator = mesh_evaluator(subject.fit.model, mesh, device, phi_i=subject.phi_i)
        self._second = None
        if other is not None and other.fit is not None:
            self._second = mesh_evaluator(other.fit.model, mesh, device, phi_i=subject.phi_i)
        grid = (mesh.rings + 1, 2 * mesh.sectors)
        self._points = np.zeros((*grid, 3), dtype=np.float32)
        self._normals = np.zeros((*grid, 3), dtype=np.float32)
        self._colours = np.zeros((*grid, 3), dtype=np.uint8)
        self._values: Single = np.zeros(mesh.shape, dtype=np.float32)
        self._column = 0
        self.reach = mesh.limit
        self.polydata = pv.PolyData()
        self.polydata.points = self._points.reshape(-1, 3)
        triangles = mesh.triangles
        self.polydata.faces = np.insert(triangles, 0, 3, axis=1).ravel()
        self.polydata.point_data["Normals"] = self._normals.reshape(-1, 3)
        self.polydata.point_data["colour"] = self._colours.reshape(-1, 3)
        # The arrays that VTK holds; writing to them changes what is drawn.
        self._points = np.asarray(self.polydata.points).reshape(*grid, 3)
        self._normals = np.asarray(self.polydata.point_data["Normals"]).reshape(*grid, 3)
        self._colours = np.asarray(self.polydata.point_data["colour"]).reshape(*grid, 3)
        self.outline = pv.PolyData()
        self.outline.SetPoints(self.polydata.GetPoints())
        curve = mesh.plane_curve
        self.outline.lines = np.append(len(curve), curve)
        self.net = pv.PolyData()
        self.net.SetPoints(self.polydata.GetPoints())
        self.net.lines = mesh.net
        self.polydata.GetPointData().SetNormals(self.polydata.GetPointData().GetArray("Normals"))
        self.polydata.GetPointData().SetActiveScalars("colour")

    @property
    def values(self) -> Single:
        """Values on what the mesh evaluates."""
        return self._values

    @property
    def cos_r(self) -> Single:
        """Cosines of the view zenith on what the mesh evaluates."""
        return np.asarray(self._evaluator.views[2])

    @property
    def vectors(self) -> Single:
        """Unit vectors of what the mesh evaluates, (*shape, 3)."""
        return np.moveaxis(self._evaluator.views[:3], 0, -1)

    def evaluate(self, column: int, theta_i: float) -> bool:
        """Evaluate the model on the device."""
        parameters = self.subject.parameters(column)
        if parameters is None:
            return False
        self._column = column
        self.reach = self.subject.reach(theta_i)
        self._evaluator.move(theta_i)
        self._values = self._evaluator.values(parameters)
        if self.other is not None and self._second is not None:
            subtracted = self.other.parameters(self.other.column(float(self.subject.wavelength[column])))
            if subtracted is None:
                return False
            self._second.move(theta_i)
            self._values = self._values - self._second.values(subtracted)
        return True

    @property
    def beyond(self) -> npt.NDArray[np.bool_]:
        """Where the model is extrapolated: beyond the largest view zenith measured, with a little room."""
        return np.asarray(self.cos_r < np.cos(np.deg2rad(min(self.reach + MARGIN, 90.0))))

    def held_by_data(self) -> tuple[Single, Single]:
        """Values and cosines of the view zenith, (K,), up to the largest one measured."""
        inside = ~self.beyond
        if not inside.any():
            inside[:] = True
        return self._values[inside], self.cos_r[inside]

    def spectra(self) -> npt.NDArray[np.float64]:
        """Values of every fitted wavelength on what is evaluated, (*shape, W); 0 where unfitted."""
        rows = [self.subject.parameters(k) for k in range(len(self.subject.wavelength))]
        nothing = np.zeros(self.mesh.shape, dtype=np.float32)
        return np.stack(
            [nothing if row is None else self._evaluator.values(row) for row in rows], axis=-1
        ).astype(np.float64)

    def draw(self, scale: RadiusScale, paint: Paint | None) -> None:
        """Move the points, turn the normals and paint."""
        views = self._evaluator.views
        length = scale.length(np.abs(self._values) if self.other is not None else self._values, views[2])
        beyond = self.beyond
        # An extrapolation would leave the picture: it ends beyond the top.
        length = np.where(beyond, np.minimum(length, np.float32(CUT_OFF)), length)
        half = views[:3] * length
        for axis in range(3):
            whole(half[axis], self._points[..., axis], odd=axis == 1)
        for axis, normal in enumerate(_grid_normals(half, self.mesh.even)):
            whole(normal, self._normals[..., axis], odd=axis == 1)
        if paint is not None:
            self.set_colours(paint(self._values))
        self.outline.Modified()
        for array in (self.polydata.GetPoints().GetData(), self.polydata.GetPointData().GetNormals()):
            array.Modified()
        self.polydata.GetPoints().Modified()
        self.polydata.Modified()

    def set_colours(self, colours: Colours) -> None:
        """Set the colours of what is evaluated, (*shape, 3); grey where it is extrapolated."""
        sectors = self.mesh.sectors
        beyond = self.beyond
        if beyond.any():
            colours = np.where(beyond[..., None], (0.25 * colours + 0.75 * EXTRAPOLATED), colours)
        if self.mesh.even:
            self._colours[:, : sectors + 1] = colours
            self._colours[:, sectors + 1 :] = colours[:, sectors - 1 : 0 : -1]
        else:
            self._colours[:] = colours
        self.polydata.GetPointData().GetScalars().Modified()


def _grid_normals(half: Single, even: bool = True) -> Single:
    """Outward normals (3, *shape) of what is evaluated of a surface.

    Products of central differences along rings and sectors. Of an even surface half is evaluated: across
    the plane of incidence the neighbours are mirror images.
    """
    along = np.empty_like(half)
    along[:, 1:-1] = half[:, 2:] - half[:, :-2]
    along[:, -1] = half[:, -1] - half[:, -2]
    along[:, 0] = along[:, 1]
    around = np.roll(half, -1, axis=2) - np.roll(half, 1, axis=2)
    if even:
        around[:, :, [0, -1]] = 0.0
        around[1, :, 0] = 2.0 * half[1, :, 1]
        around[1, :, -1] = -2.0 * half[1, :, -2]
    out = np.empty_like(half)
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(along[b] * around[c], along[c] * around[b], out=out[a])
    out /= np.sqrt((out * out).sum(axis=0)) + np.float32(1e-30)
    # All sectors meet in the mirror direction; of an even surface the normal there lies in the plane of
    # incidence.
    middle = out[:, 1].mean(axis=1)
    out[:, 0] = np.array([middle[0], 0.0 if even else middle[1], middle[2]], dtype=np.float32)[:, None]
    return out


class MeasuredLobe:
    """Measured values joined: by triangles over the hemisphere, by a sheet in the plane of incidence.

    With `other`, the difference self − other at the measured directions; of those `asked` for at the incident
    zenith, `compared` have a value on both sides.
    """

    def __init__(self, subject: Subject, other: Subject | None = None) -> None:
        import pyvista as pv

        self.subject, self.other = subject, other
        self.polydata = pv.PolyData()
        self.outline = None
        self.net = None
        self.asked, self.compared = 0, 0
        self._values = np.zeros(0)
        self._cos_r = np.zeros(0)
        self._vectors = np.zeros((0, 3))
        self._members: tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]] = (
            np.zeros(0, dtype=np.intp),
            np.zeros(0, dtype=np.intp),
        )

    @property
    def values(self) -> npt.NDArray[np.float64]:
        """Measured values, (K,)."""
        return self._values

    @property
    def cos_r(self) -> npt.NDArray[np.float64]:
        """Cosines of their view zenith, (K,)."""
        return self._cos_r

    @property
    def vectors(self) -> npt.NDArray[np.float64]:
        """Unit vectors of their directions, (K, 3)."""
        return self._vectors

    def held_by_data(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """All values, and cosines of their view zenith, (K,)."""
        return self._values, self._cos_r

    def evaluate(self, column: int, theta_i: float) -> bool:
        """Take the usable values of the directions at this incident zenith, the mean where one repeats."""
        scan = self.subject.scan
        rows = self.subject.rows(theta_i)
        self.asked = len(rows)
        rows = rows[~scan.mask[rows, column]]
        values = scan.brdf[rows, column]
        self.compared = 0
        if self.other is not None:
            values = values - reference_values(self.other, self.subject, rows, column)
            rows, values = rows[np.isfinite(values)], values[np.isfinite(values)]
            self.compared = len(rows)
        if len(rows) == 0:
            self.polydata.copy_structure(_nothing())
            return False
        angles = np.column_stack(
            [scan.theta_r[rows], np.where(scan.theta_r[rows] == 0.0, 0.0, scan.phi[rows])]
        )
        places, where = np.unique(angles, axis=0, return_inverse=True)
        counts = np.bincount(where.ravel())
        self._values = np.bincount(where.ravel(), weights=values) / counts
        self._cos_r = np.cos(np.deg2rad(places[:, 0]))
        self._vectors = unit_vectors(places[:, 0], places[:, 1])
        self._members = rows, where.ravel()
        return True

    def spectra(self) -> npt.NDArray[np.float64]:
        """Measured spectra of the same points, (K, W); masked values are bridged along the wavelength."""
        scan, (rows, where) = self.subject.scan, self._members
        bridged = np.empty((len(rows), len(scan.wavelength)))
        for k, row in enumerate(rows):
            good = ~scan.mask[row]
            bridged[k] = np.interp(scan.wavelength, scan.wavelength[good], scan.brdf[row, good])
        out = np.zeros((len(self._values), len(scan.wavelength)))
        np.add.at(out, where, bridged)
        return out / np.bincount(where)[:, None]

    def draw(self, scale: RadiusScale, paint: Paint | None) -> None:
        """Build the surface anew: a few hundred points."""
        import pyvista as pv

        signed = self.other is not None
        lengths = scale.length(np.abs(self._values) if signed else self._values, self._cos_r)
        points = self._vectors * lengths[:, None]
        triangles, lines = joined_directions(self._vectors)
        origin = len(points)
        faces = np.where(triangles < 0, origin, triangles)
        new = pv.PolyData()
        new.points = np.vstack([points, np.zeros(3)]).astype(np.float32)
        if len(faces):
            new.faces = np.insert(faces, 0, 3, axis=1).ravel()
        if len(lines):
            new.lines = np.insert(np.where(lines < 0, origin, lines), 0, 2, axis=1).ravel()
        new.point_data["colour"] = np.full((len(points) + 1, 3), 160, dtype=np.uint8)
        if paint is not None:
            new.point_data["colour"][:-1] = paint(self._values)
        self.polydata.shallow_copy(new)
        self.polydata.GetPointData().SetActiveScalars("colour")

    def set_colours(self, colours: Colours) -> None:
        """Set the colours of all values, (K, 3)."""
        self.polydata.point_data["colour"][:-1] = colours
        self.polydata.Modified()


def _nothing() -> Any:
    import pyvista as pv

    return pv.PolyData()


def reference_values(
    other: Subject, subject: Subject, rows: npt.NDArray[np.intp], column: int
) -> npt.NDArray[np.float64]:
    """Values of another subject in directions of a scan at its nearest wavelength; NaN where it has none.

    Where it has a fit, its model as the detector sees it; else its measured value in the same direction
    within 0.05°.
    """
    scan = subject.scan
    nearest = other.column(float(subject.wavelength[column]))
    if other.fit is not None:
        if other is subject:
            return other.seen_values(nearest, rows)
        return seen_along(other.fit, scan.directions[rows], nearest)
    theirs = other.scan
    ours = np.column_stack([scan.theta_i, scan.theta_r, scan.phi])[rows]
    keys = np.column_stack([theirs.theta_i, theirs.theta_r, theirs.phi])
    out = np.full(len(rows), np.nan)
    for k, direction in enumerate(ours):
        gap = np.abs(keys - direction)
        gap[:, 2] = np.minimum(gap[:, 2], 360.0 - gap[:, 2]) * np.sin(np.deg2rad(direction[1]))
        same = (gap <= 0.05).all(axis=1) & ~theirs.mask[:, nearest]
        if same.any():
            out[k] = theirs.brdf[same, nearest].mean()
    return out

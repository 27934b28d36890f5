"""Measured points on a lobe, each with a whisker to the model: the residual, at the scale of the lobe.

Points are drawn in front of the surface, so that none hides inside it. A whisker is orange where the
measured value lies above the model and blue where it lies below.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.directions import unit_vectors
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.style import BLACK, BLUE, VERMILION, rgb
from clbrdf.viz.subject import Subject

Array = npt.NDArray[np.float64]
ABOVE = np.array(rgb(VERMILION)) * 255.0
BELOW = np.array(rgb(BLUE)) * 255.0
TO_THE_FRONT = -66000.0
"""Depth offset, in units of the depth buffer's step, that puts marks before any surface."""


MOST_POINTS = 1500
"""More would hide the lobe: of these every second, third… is drawn, and the caption says so."""
SMALLER = ((600, 0.35), (150, 0.65))
"""From so many points on they are drawn smaller, by this factor."""


class Marks:
    """Measured points and whiskers of one subject in one renderer.

    Parameters
    ----------
    renderer : vtkRenderer
    subject : Subject
    size : float
        Diameter of a point, pixels; of many points less.
    colour : str, optional
        "#rrggbb" of points among those of other subjects, which have no whiskers.
    """

    def __init__(self, renderer: Any, subject: Subject, size: float = 7.0, colour: str = "") -> None:
        import pyvista as pv
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        self.subject, self.size, self.alone = subject, size, not colour
        self.points, self.whiskers = pv.PolyData(), pv.PolyData()
        self._actors = []
        for data in (self.whiskers, self.points):
            mapper = vtkPolyDataMapper()
            mapper.SetInputData(data)
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyPointOffsetParameter(TO_THE_FRONT)
            mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, TO_THE_FRONT)
            actor = vtkActor()
            actor.SetMapper(mapper)
            actor.GetProperty().SetPointSize(size)
            actor.GetProperty().SetLineWidth(2.5)
            actor.GetProperty().SetColor(*rgb(colour or BLACK))
            actor.GetProperty().LightingOff()
            actor.PickableOff()
            renderer.AddActor(actor)
            self._actors.append(actor)
        self.rows: npt.NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        self.masked = 0
        self.column = 0
        self.positions = np.zeros((0, 3))
        self.drawn: npt.NDArray[np.intp] = np.zeros(0, dtype=np.intp)

    @property
    def visible(self) -> bool:
        """Whether they are drawn."""
        return bool(self._actors[0].GetVisibility())

    @visible.setter
    def visible(self, shown: bool) -> None:
        for actor in self._actors:
            actor.SetVisibility(shown)

    def find(self, column: int, theta_i: float) -> None:
        """Look up the directions measured at an incident zenith (degrees) and count the masked values."""
        scan, rows = self.subject.scan, self.subject.rows(theta_i)
        masked = scan.mask[rows, column]
        self.column, self.rows, self.masked = column, rows[~masked], int(masked.sum())
        every = -(-len(self.rows) // MOST_POINTS)
        self.drawn = np.arange(0, len(self.rows), max(1, every))
        share = next((share for most, share in SMALLER if len(self.drawn) > most), 1.0)
        self._actors[1].GetProperty().SetPointSize(max(2.0, share * self.size))

    @property
    def values(self) -> Array:
        """Measured values shown, (K,), 1/sr."""
        return np.asarray(self.subject.scan.brdf[self.rows, self.column])

    @property
    def cos_r(self) -> Array:
        """Cosines of their view zenith, (K,)."""
        return np.cos(np.deg2rad(self.subject.scan.theta_r[self.rows]))

    @property
    def model(self) -> Array | None:
        """Model values as the detector sees them in the same directions, (K,), 1/sr; None without a fit."""
        if self.subject.parameters(self.column) is None:
            return None
        return self.subject.seen_values(self.column, self.rows)

    def draw(self, scale: RadiusScale) -> None:
        """Put points and whiskers where a scale wants them."""
        import pyvista as pv

        scan = self.subject.scan
        vectors = unit_vectors(scan.theta_r[self.rows], scan.phi[self.rows])
        measured, model = self.values, self.model
        points, whiskers = pv.PolyData(), pv.PolyData()
        self.positions = vectors * scale.length(measured, self.cos_r)[:, None]
        shown = self.positions[self.drawn]
        if len(self.rows):
            points = pv.PolyData(shown.astype(np.float32))
        if len(self.rows) and model is not None and self.alone:
            ends = (vectors * scale.length(model, self.cos_r)[:, None])[self.drawn]
            count = len(ends)
            pairs = np.stack([np.full(count, 2), np.arange(count), np.arange(count) + count], axis=-1)
            whiskers = pv.PolyData(np.vstack([shown, ends]).astype(np.float32), lines=pairs.ravel())
            colours = np.where((measured > model)[self.drawn, None], ABOVE, BELOW).astype(np.uint8)
            whiskers.point_data["colour"] = np.vstack([colours, colours])
            whiskers.GetPointData().SetActiveScalars("colour")
        self.points.shallow_copy(points)
        self.whiskers.shallow_copy(whiskers)

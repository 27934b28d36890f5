"""The BRDF that an RGL file stands for, as Mitsuba's `measured` plugin evaluates it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.formats.rgl.coordinates import azimuth_coordinate, half_vector, zenith_coordinate
from clbrdf.formats.rgl.tables import Tables
from clbrdf.formats.rgl.warp import Mixture, Warp, grid_cell
from clbrdf.geometry import broadcast_angles, check_zenith

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

BLOCK = 2_000_000
"""Values computed at a time: bounds the memory that is needed to some 100 MB."""


class TensorReader:
    """Evaluates one set of tables; the integrals of its densities are kept."""

    def __init__(self, tables: Tables) -> None:
        self.tables = tables
        vndf = tables.vndf
        self._warp = Warp.of(_filled(vndf.reshape(-1, *vndf.shape[2:])))
        self._axes = (
            np.asarray(tables.phi_i, dtype=np.float64),
            np.asarray(tables.theta_i, dtype=np.float64),
        )

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_r: npt.ArrayLike,
        phi: npt.ArrayLike,
        phi_i: npt.ArrayLike = 0.0,
    ) -> Array:
        """Return the BRDF, (N, W), 1/sr without the cosine, at the wavelengths or bands of the file.

        Parameters
        ----------
        theta_i, theta_r : float or (N,) array
            Degrees, [0, 90).
        phi : float or (N,) array
            φr − φi, degrees, 180 forward.
        phi_i : float or (N,) array
            Incident azimuth, degrees; of no effect for an isotropic material.

        Raises
        ------
        InputError
            Zeniths out of range, or lengths that do not agree.
        """
        angles = broadcast_angles(theta_i, theta_r, phi, phi_i)
        check_zenith("theta_i", angles[0])
        check_zenith("theta_r", angles[1])
        out = np.empty((len(angles[0]), self.tables.bands))
        rows = max(1, BLOCK // self.tables.bands)
        for start in range(0, len(out), rows):
            part = slice(start, start + rows)
            out[part] = self._block(*(np.deg2rad(a[part]) for a in angles))
        return out

    def _block(self, theta_i: Array, theta_r: Array, phi: Array, phi_i: Array) -> Array:
        tables = self.tables
        theta_m, phi_m = half_vector(theta_i, theta_r, phi)
        if not tables.isotropic:
            phi_i, phi_m = _folded(tables.folds, phi_i, phi_m)
        phi_i = np.arctan2(np.sin(phi_i), np.cos(phi_i))
        x, y = zenith_coordinate(theta_m), azimuth_coordinate(phi_m)
        azimuths, zeniths = _mixture(self._axes[0], phi_i), _mixture(self._axes[1], theta_i)
        count = len(self._axes[1])
        pairs = [(a, z) for a in azimuths for z in zeniths]
        mixture = Mixture(
            np.array([a[0] * count + z[0] for a, z in pairs]), np.array([a[1] * z[1] for a, z in pairs])
        )
        share_x, share_y = self._warp.share(mixture, x, y)
        side = tables.spectra.shape[-1]
        column, fx = grid_cell(share_x, side)
        row, fy = grid_cell(share_y, side)
        total = np.zeros((len(x), tables.bands))
        for (pa, wa), (pz, wz) in pairs:
            for dy, wy in ((0, 1.0 - fy), (1, fy)):
                for dx, wx in ((0, 1.0 - fx), (1, fx)):
                    corner = tables.spectra[pa, pz, :, row + dy, column + dx]
                    total += (wa * wz * wy * wx)[:, None] * corner
        if tables.jacobian:
            facets = _plane(tables.ndf, x, y)
            area = _plane(tables.sigma, zenith_coordinate(theta_i), azimuth_coordinate(phi_i))
            total *= (facets / (4.0 * area))[:, None]
        return np.asarray(total / np.cos(theta_r)[:, None])


def _filled(vndf: npt.NDArray[np.float32]) -> Array:
    """Densities in fp64; one that is 0 everywhere (grazing incidence on a rough surface) becomes uniform."""
    density = vndf.astype(np.float64)
    density[~(density > 0.0).any(axis=(1, 2))] = 1.0
    return density


def _mixture(nodes: Array, values: Array) -> list[tuple[Places, Array]]:
    """Nodes on both sides of values with the weights of linear interpolation, held beyond the ends."""
    if len(nodes) == 1:
        return [(np.zeros(len(values), dtype=np.intp), np.ones(len(values)))]
    low = np.clip(np.searchsorted(nodes, values, side="right") - 1, 0, len(nodes) - 2)
    weight = np.clip((values - nodes[low]) / (nodes[low + 1] - nodes[low]), 0.0, 1.0)
    return [(low, 1.0 - weight), (low + 1, weight)]


def _plane(table: npt.NDArray[np.float32], x: Array, y: Array) -> Array:
    """Interpolate a table over (y, x)."""
    row, fy = grid_cell(y, table.shape[0])
    column, fx = grid_cell(x, table.shape[1])
    low = (1.0 - fx) * table[row, column] + fx * table[row, column + 1]
    high = (1.0 - fx) * table[row + 1, column] + fx * table[row + 1, column + 1]
    return np.asarray((1.0 - fy) * low + fy * high)


def _folded(folds: int, phi_i: Array, phi_m: Array) -> tuple[Array, Array]:
    """Turn or mirror directions so that the incident azimuth lies in the part that was measured.

    Azimuths of half vectors come relative to the incident one and leave absolute. Two folds: the surface
    looks the same after half a turn. Four: mirrored at both axes as well.
    """
    absolute = phi_m + phi_i
    if folds == 2:
        turn = np.where(np.sin(phi_i) > 0.0, np.pi, 0.0)
        return phi_i - turn, absolute - turn
    if folds == 4:
        wrong_x, wrong_y = np.cos(phi_i) > 0.0, np.sin(phi_i) > 0.0
        for wrong, mirror in ((wrong_x, np.pi), (wrong_y, 0.0)):
            phi_i = np.where(wrong, mirror - phi_i, phi_i)
            absolute = np.where(wrong, mirror - absolute, absolute)
    return phi_i, absolute

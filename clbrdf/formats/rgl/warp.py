"""Densities on the unit square, tabulated on grids, and the maps that make them uniform.

A density stands on Y × X nodes and is bilinear between them. Its map takes (u_x, u_y) to
(s_x, s_y): s_y is the share of the density below u_y (the marginal distribution), s_x the share left
of u_x on the line of constant u_y (the conditional distribution). Both are exact integrals of the
bilinear density, so that the map can be inverted in closed form.

A stack of L densities is normalised one by one; between them densities are mixed, not maps, which is
what Mitsuba's `measured` plugin does between incident directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

EDGE = 2.0**-24
"""How far from 0 and 1 shares are kept: at 0 and 1 themselves a density of 0 leaves the place open."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Which densities of a stack stand for each of N points, and with what weights.

    Attributes
    ----------
    places : (C, N) int
    weights : (C, N) float64
        Sum 1 over C.
    """

    places: Places
    weights: Array


@dataclass(frozen=True, eq=False)
class Warp:
    """A stack of densities with their integrals.

    Attributes
    ----------
    density : (L, Y, X) float64
        Normalised: the integral in units of grid cells is 1.
    along : (L, Y, X) float64
        Integral over x from the first node, on each row.
    below : (L, Y) float64
        Integral over all x and over y from the first row.
    """

    density: Array
    along: Array
    below: Array

    @classmethod
    def of(cls, density: npt.ArrayLike) -> Warp:
        """Normalise and integrate densities (L, Y, X), not negative, none of them 0 everywhere."""
        values = np.asarray(density, dtype=np.float64)
        along = _integral(values)
        below = _integral(along[..., -1])
        total = below[:, -1, None, None]
        return cls(values / total, along / total, below / total[..., 0])

    def share(self, mixture: Mixture, x: Array, y: Array) -> tuple[Array, Array]:
        """Map points (N,) of [0, 1]² to shares (s_x, s_y), each (N,), under a mixture of densities."""
        _, rows, columns = self.density.shape
        px, fx = grid_cell(x, columns)
        py, fy = grid_cell(y, rows)

        def mixed(table: Array, *at: Places) -> Array:
            return np.asarray(
                sum(w * table[(k, *at)] for k, w in zip(mixture.places, mixture.weights, strict=True))
            )

        def left(row: Places) -> Array:
            first, second = mixed(self.density, row, px), mixed(self.density, row, px + 1)
            return mixed(self.along, row, px) + fx * (first + 0.5 * fx * (second - first))

        last = np.full_like(px, columns - 1)
        row, next_row = mixed(self.along, py, last), mixed(self.along, py + 1, last)
        whole = row + fy * (next_row - row)
        part = (1.0 - fy) * left(py) + fy * left(py + 1)
        share_x = np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0)
        return share_x, mixed(self.below, py) + fy * (row + 0.5 * fy * (next_row - row))

    def place(self, density: int, share_x: Array, share_y: Array) -> tuple[Array, Array]:
        """Return the point with given shares under one density: x (B, A) and y (B,), from (A,) and (B,).

        Shares are kept 2⁻²⁴ away from 0 and 1.
        """
        values, along, below = self.density[density], self.along[density], self.below[density]
        rows, columns = values.shape
        sx, sy = np.clip(share_x, EDGE, 1.0 - EDGE), np.clip(share_y, EDGE, 1.0 - EDGE)
        py = np.clip(np.searchsorted(below, sy, side="right") - 1, 0, rows - 2)
        fy = _step(sy - below[py], along[py, -1], along[py + 1, -1])
        up = fy[:, None]
        line = (1.0 - up) * values[py] + up * values[py + 1]
        integral = (1.0 - up) * along[py] + up * along[py + 1]
        target = sx[None, :] * integral[:, -1:]
        # One sorted search for all rows: each row is moved to an interval of its own.
        shift = np.arange(len(sy))[:, None] * (2.0 * integral[:, -1].max())
        found = np.searchsorted((integral + shift).ravel(), (target + shift).ravel(), side="right")
        px = found.reshape(target.shape) - 1 - columns * np.arange(len(sy))[:, None]
        px = np.clip(px, 0, columns - 2)
        fx = _step(
            target - np.take_along_axis(integral, px, 1),
            np.take_along_axis(line, px, 1),
            np.take_along_axis(line, px + 1, 1),
        )
        return (px + fx) / (columns - 1), (py + fy) / (rows - 1)


def grid_cell(u: Array, nodes: int) -> tuple[Places, Array]:
    """Cell of coordinates in [0, 1] on a grid of nodes, and the place within it, [0, 1]."""
    scaled = np.clip(u, 0.0, 1.0) * (nodes - 1)
    place = np.minimum(scaled.astype(np.intp), nodes - 2)
    return place, scaled - place


def _integral(values: Array) -> Array:
    """Integral by trapezoids along the last axis, 0 at the first node."""
    out = np.zeros_like(values)
    np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1, out=out[..., 1:])
    return out


def _step(share: Array, first: Array, second: Array) -> Array:
    """Where, in [0, 1], the integral of a density linear from `first` to `second` reaches a share.

    The root of (second − first)/2 t² + first t = share without cancellation.
    """
    root = np.sqrt(np.maximum(first * first + 2.0 * (second - first) * share, 0.0))
    out = np.divide(2.0 * share, first + root, out=np.zeros_like(share), where=first + root > 0.0)
    return np.clip(out, 0.0, 1.0)

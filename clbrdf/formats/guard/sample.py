"""The part of a reading that the guard looks at: reflection, one number a direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.scan.rectangle import group_numbers

Array = npt.NDArray[np.float64]

MOST_ROWS = 200_000
MOST_COLUMNS = 16
MOST_GROUPS = 8
FEW = 5
"""Directions that a group of one incidence needs."""

MOST_INCIDENCES, SMALL = 1000, 100
"""More incidences than this with fewer directions each are no grid, but rounding's."""

WINDOW = 1.0
"""Degrees about an incidence, where all directions have incidences of their own."""


@dataclass(frozen=True, eq=False)
class Group:
    """Directions of one incidence; φ as the file counts it, degrees."""

    theta_i: float
    theta_r: Array
    phi: Array
    shape: Array
    bright: Array


@dataclass(frozen=True, eq=False)
class UsableSample:
    """Usable directions of reflection.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi : (N,) float64
        Degrees.
    shape : (N,) float64
        Mean over columns, each divided by its own mean.
    bright : (N,) float64
        The column with the largest mean, as in the file.
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi: Array
    shape: Array
    bright: Array

    def groups(self) -> Iterator[Group]:
        """Give the directions of a few incidences that have several of them."""
        if len(self.theta_i) == 0:
            return
        turned = group_numbers(np.stack([self.theta_i, self.phi_i], axis=1).round(2))
        counts = np.bincount(turned)
        scattered = len(counts) > MOST_INCIDENCES and len(turned) < SMALL * len(counts)
        if (counts >= FEW).any() and not scattered:
            large = np.flatnonzero(counts >= FEW)
            chosen = large[np.linspace(0, len(large) - 1, min(MOST_GROUPS, len(large))).round().astype(int)]
            for number in chosen:
                yield self._group(turned == number)
            return
        for centre in np.unique(np.quantile(self.theta_i, [0.1, 0.3, 0.5, 0.7, 0.9])):
            rows = np.abs(self.theta_i - centre) <= WINDOW
            if rows.sum() >= FEW:
                yield self._group(rows)

    def _group(self, rows: npt.NDArray[np.bool_]) -> Group:
        return Group(
            float(self.theta_i[rows].mean()),
            self.theta_r[rows],
            self.phi[rows],
            self.shape[rows],
            self.bright[rows],
        )


def make_sample(
    theta_i: Array, phi_i: Array, theta_r: Array, phi: Array, values: Array, usable: npt.NDArray[np.bool_]
) -> UsableSample:
    """Return what the guard looks at, of angles (N,) in degrees and values (N, W)."""
    rows = np.flatnonzero((theta_r < 90.0) & (theta_i < 90.0))
    if len(rows) > MOST_ROWS:
        # At random, since a stride would keep step with the file's own order.
        rows = np.sort(np.random.default_rng(0).choice(rows, MOST_ROWS, replace=False))
    columns = np.arange(values.shape[1])
    if len(columns) > MOST_COLUMNS:
        columns = columns[:: -(-len(columns) // MOST_COLUMNS)]
    part = np.where(usable[np.ix_(rows, columns)], values[np.ix_(rows, columns)], np.nan)
    counts = np.isfinite(part).sum(axis=0)
    part = part[:, counts > 0]
    good = np.isfinite(part).any(axis=1)
    part, rows = part[good], rows[good]
    if part.size == 0:
        empty = np.empty(0)
        return UsableSample(empty, empty, empty, empty, empty, empty)
    # Rows without one of the columns would tilt means of unequal columns; ratios to each one's mean do not.
    means = np.nanmean(part, axis=0)
    shape = np.nanmean(part / np.where(means == 0.0, 1.0, means), axis=1)
    bright = part[:, int(np.argmax(means))]
    seen = np.isfinite(bright)
    rows, shape, bright = rows[seen], shape[seen], bright[seen]
    return UsableSample(
        theta_i[rows], np.mod(phi_i[rows], 360.0), theta_r[rows], np.mod(phi[rows], 360.0), shape, bright
    )

"""Off the limits again: ends at a limit where the gradient vanishes may be no minimum.

A long step is cut at a limit, and where the model is flat there (the mean slope of Hapke's model at 0),
nothing leads back. From each end, each nonlinear coordinate at a limit is moved inside by itself, and the
polish tells whether it stays.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.polish import AS_LOW, MOST_ITERATIONS, TOLERANCE, descend
from clbrdf.fit.problem import Problem
from clbrdf.opencl.precision import get_precision

Array = npt.NDArray[np.float64]

INSIDE = 0.1
"""Share of its range by which a coordinate is moved off its limit."""


def off_limits(
    problem: Problem, ends: Array, energy: Array
) -> tuple[Array, Array, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return coordinates (W, P), E (W,), evaluations (W,), and how many of the tries found it (W,).

    Where none is lower, coordinates and E are those given, and 0 have found it.

    Parameters
    ----------
    problem : Problem
    ends : (W, P) float64
        Coordinates.
    energy : (W,) float64
        E there.
    """
    searched = np.array([j for j in problem.free if j not in problem.model.linear], dtype=np.intp)
    spent, found = np.zeros((2, len(ends)), dtype=np.int64)
    at_low = ends[:, searched] <= problem.lower[:, searched]
    at = at_low | (ends[:, searched] >= problem.upper[:, searched])
    rows = np.flatnonzero(at.any(axis=1))
    if len(rows) == 0:
        return ends, energy, spent, found
    most = int(at.sum(axis=1).max())
    starts = np.repeat(ends[rows, None], most, axis=1)
    asked = np.zeros(starts.shape[:2], dtype=np.bool_)
    span = problem.upper - problem.lower
    for k, row in enumerate(rows):
        for n, place in enumerate(np.flatnonzero(at[row])):
            j, inwards = searched[place], 1.0 if at_low[row, place] else -1.0
            starts[k, n, j] += inwards * INSIDE * span[row, j]
            asked[k, n] = True
    part = problem.take(rows)
    done = descend(part, starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE, ~asked)
    tried = np.where(asked & np.isfinite(done.objective), done.objective, np.inf)
    best, order = tried.argmin(axis=1), np.arange(len(rows))
    spent[rows] = np.where(asked, done.evaluations, 0).sum(axis=1)
    lower = tried[order, best] < energy[rows] * (1.0 - AS_LOW)
    coordinates, lowest = ends.copy(), energy.copy()
    coordinates[rows[lower]] = done.coordinates[order, best][lower]
    lowest[rows[lower]] = tried[order, best][lower]
    same = tried <= tried[order, best][:, None] * (1.0 + AS_LOW)
    found[rows[lower]] = same.sum(axis=1)[lower]
    return coordinates, lowest, spent, found

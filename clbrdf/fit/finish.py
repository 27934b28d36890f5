"""Many directions: the ends of a polish on a sample of them, taken to the end on all.

The sample tells which optima there are, and where about. Which is the lowest, and where exactly, all
directions decide. So the cost of a search does not grow with their number; that of a fit grows by a few
passes over them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.polish import (
    AS_LOW,
    CLEARLY_HIGHER,
    EXACT,
    FIRST_DAMPING,
    MOST_ITERATIONS,
    NEAR_DAMPING,
    ROUGH_ITERATIONS,
    ROUGH_TOLERANCE,
    TOLERANCE,
    WORTH,
    Polished,
    descend,
    left_as_they_are,
)
from clbrdf.fit.problem import Problem
from clbrdf.fit.sample import SAMPLE
from clbrdf.opencl.precision import get_precision

Array = npt.NDArray[np.float64]

MOST_ENDS = 4
"""Different ends that go on to all directions: one vector of lanes on most devices."""

FEW = 8
"""Iterations after which an end that is still clearly higher than the lowest is given up."""

LANES = 8
"""Ends that go on at once, or as many as there are wavelengths: one vector, so that few do not cost more."""


@dataclass(frozen=True, eq=False)
class Ends:
    """The lowest different ends at W wavelengths, the lowest first.

    Attributes
    ----------
    coordinates : (W, MOST_ENDS, P) float64
    objective : (W, MOST_ENDS) float64
        E; infinite where there are fewer ends.
    starts : (W, MOST_ENDS) int64
        That came to each.
    """

    coordinates: Array
    objective: Array
    starts: npt.NDArray[np.int64]

    def take(self, rows: npt.NDArray[np.intp]) -> Ends:
        """Return the ends at some wavelengths."""
        return Ends(*(getattr(self, field.name)[rows] for field in fields(self)))


def lowest_ends(coordinates: Array, objective: Array, starts: npt.NDArray[np.int64] | None = None) -> Ends:
    """Return the lowest different ends of all (W, K, P) with E (W, K); ends as low as each other are one."""
    left = np.where(np.isfinite(objective), objective, np.inf)
    count = np.ones(left.shape, dtype=np.int64) if starts is None else starts
    rows, found = np.arange(len(left)), []
    for _ in range(MOST_ENDS):
        best = left.argmin(axis=1)
        energy = left[rows, best]
        same = np.isfinite(left) & (left <= np.maximum(energy * (1.0 + AS_LOW), EXACT)[:, None])
        found.append((coordinates[rows, best], energy, np.where(same, count, 0).sum(axis=1)))
        left = np.where(same, np.inf, left)
    return Ends(*(np.stack(part, axis=1) for part in zip(*found, strict=True)))


def together(parts: Sequence[Ends]) -> Ends:
    """Return the lowest different ends of several looks at the same wavelengths."""
    q, energy, starts = (np.concatenate([getattr(p, f.name) for p in parts], axis=1) for f in fields(Ends))
    return lowest_ends(q, energy, starts)


def finish(problem: Problem, ends: Ends, depth: str) -> Polished:
    """Polish the ends of a sample on all directions of a problem, as far as `depth` says (`polish`).

    Raises
    ------
    DeviceError
        The device has no fp64, or cannot build or run the kernel.
    """
    moving = ends.objective <= np.maximum(WORTH * ends.objective[:, :1], EXACT)
    moving[:, 0] = True
    most = int(moving.sum(axis=1).max())
    q, moving = ends.coordinates[:, :most].copy(), moving[:, :most]
    done = Polished(q, np.full(moving.shape, np.inf), moving.astype(np.int64), np.zeros_like(moving))
    if depth == "double":
        _to_the_end(problem, done, moving)
        return done
    if depth == "single":
        rough = descend(problem, q, get_precision("fast:6"), ROUGH_ITERATIONS, ROUGH_TOLERANCE, ~moving)
        q = np.where((moving & np.isfinite(rough.objective))[..., None], rough.coordinates, q)
        done.evaluations[moving] += rough.evaluations[moving]
    energy = left_as_they_are(problem, q, done.evaluations).objective
    return replace(done, coordinates=q, objective=np.where(moving, energy, np.inf))


def _to_the_end(problem: Problem, done: Polished, moving: npt.NDArray[np.bool_]) -> None:
    """Polish the moving ends (W, K), which lie side by side in the lanes; write them into `done`."""
    w, n = problem.size
    tolerance = TOLERANCE * max(1.0, np.sqrt(n / SAMPLE))  # the rounding of E grows with the sum
    for iterations, damping in ((FEW, NEAR_DAMPING), (MOST_ITERATIONS, FIRST_DAMPING)):
        row, k = np.nonzero(moving)
        for first in range(0, len(row), max(LANES, w)):
            part = slice(first, first + max(LANES, w))
            some, end = row[part], k[part]
            of_them = problem if np.array_equal(some, np.arange(w)) else problem.take(some)
            start = done.coordinates[some, end][:, None]
            at = descend(of_them, start, get_precision("double"), iterations, tolerance, damping=damping)
            done.coordinates[some, end], done.objective[some, end] = at.coordinates[:, 0], at.objective[:, 0]
            done.evaluations[some, end] += at.evaluations[:, 0]
            done.converged[some, end] = at.converged[:, 0]
        low = done.objective <= CLEARLY_HIGHER * done.objective.min(axis=1, keepdims=True)
        moving = moving & low & ~done.converged

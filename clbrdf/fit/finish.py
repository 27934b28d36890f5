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
from clbrdf.opencl.precision import get_precision

Array = npt.NDArray[np.float64]

MOST_ENDS = 4
"""Different ends that go on to all directions: one vector of lanes on most devices."""

FEW = 8
"""Iterations after which an end that is still clearly higher than the first is given up."""


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
        for k in range(most):
            _to_the_end(problem, done, k, np.flatnonzero(moving[:, k]))
        return done
    if depth == "single":
        rough = descend(problem, q, get_precision("fast:6"), ROUGH_ITERATIONS, ROUGH_TOLERANCE, ~moving)
        q = np.where((moving & np.isfinite(rough.objective))[..., None], rough.coordinates, q)
        done.evaluations[moving] += rough.evaluations[moving]
    energy = left_as_they_are(problem, q, done.evaluations).objective
    return replace(done, coordinates=q, objective=np.where(moving, energy, np.inf))


def _to_the_end(problem: Problem, done: Polished, k: int, rows: npt.NDArray[np.intp]) -> None:
    """Polish end k of some wavelengths, which lie side by side in the lanes; write it into `done`."""
    damping = NEAR_DAMPING
    for iterations in (FEW, MOST_ITERATIONS) if k else (MOST_ITERATIONS,):
        if len(rows) == 0:
            return
        part = problem if len(rows) == problem.size[0] else problem.take(rows)
        start = done.coordinates[rows, k : k + 1]
        at = descend(part, start, get_precision("double"), iterations, TOLERANCE, damping=damping)
        done.coordinates[rows, k], done.objective[rows, k] = at.coordinates[:, 0], at.objective[:, 0]
        done.evaluations[rows, k] += at.evaluations[:, 0]
        done.converged[rows, k] = at.converged[:, 0]
        low = done.objective[rows, k] <= CLEARLY_HIGHER * done.objective[rows, 0]
        rows, damping = rows[low & ~done.converged[rows, k]], FIRST_DAMPING

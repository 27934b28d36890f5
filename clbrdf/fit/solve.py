"""From a problem to its solution: search, polish, and a second look where there is doubt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.blocks import wavelength_blocks
from clbrdf.fit.finish import Ends, finish, lowest_ends, together
from clbrdf.fit.limits import off_limits
from clbrdf.fit.methods import Method
from clbrdf.fit.polish import AS_LOW, EXACT, MOST_ITERATIONS, TOLERANCE, Polished, descend, polish
from clbrdf.fit.problem import Problem
from clbrdf.fit.sample import MANY, SAMPLE, DirectionSample, sample_of
from clbrdf.fit.thin import measured_enough, on_sample
from clbrdf.opencl.precision import get_precision
from clbrdf.progress import Report, silent

Array = npt.NDArray[np.float64]

ENOUGH = 0.3
"""Share of the starts that have to agree for the first look to be the last."""

FOLLOWED = 12
"""Passes over the directions that a polish takes from a near optimum, at most as a rule."""
ROUNDING = 1e-12
"""Relative differences of E below this are rounding of its sum."""

LEAST_MEASURED = SAMPLE // 4
"""Values that a wavelength has to have on a sample of many directions, if it has as many at all."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The best end at each of W wavelengths.

    Attributes
    ----------
    coordinates : (W, P) float64
    objective : (W,) float64
        E.
    converged : (W,) bool
        Stopped at a stationary point, not by the limit on iterations.
    starts, agreeing : (W,) int64
        Starts of the polish, and how many of them ended at the lowest E.
    evaluations, not_finite : (W,) int64
    acceptance : (W,) float64
    doubtful : (W,) bool
        As of `Candidates`; evaluations with those of the polish.
    """

    coordinates: Array
    objective: Array
    converged: npt.NDArray[np.bool_]
    starts: npt.NDArray[np.int64]
    agreeing: npt.NDArray[np.int64]
    evaluations: npt.NDArray[np.int64]
    not_finite: npt.NDArray[np.int64]
    acceptance: Array
    doubtful: npt.NDArray[np.bool_]


def solve(problem: Problem, method: Method, settings: Any, seed: int, report: Report) -> Solution:
    """Solve every wavelength of a problem; of many directions all but the end on a sample of them.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    if problem.size[1] <= MANY or getattr(settings, "everywhere", False):
        return _look(problem, method, settings, seed, report)[0]
    sample = problem.sample or sample_of(problem.mirror, SAMPLE)
    few = on_sample(problem, sample)
    enough = measured_enough(problem, few, LEAST_MEASURED)
    rows, parts = np.flatnonzero(enough), []
    if len(rows):
        parts.append(_on_sample(problem.take(rows), few.take(rows), method, settings, seed, report))
    for k in np.flatnonzero(~enough):  # a sample of what is measured there
        seen = np.flatnonzero(problem.scale[k] > 0.0)
        alone = on_sample(problem.take(np.array([k])), DirectionSample(seen, np.ones(len(seen))))
        parts.append(solve(alone, method, settings, seed, silent))
    if len(parts) == 1:
        return parts[0]
    back = np.argsort(np.concatenate([rows, np.flatnonzero(~enough)]))
    together = joined(parts)
    return Solution(**{field.name: getattr(together, field.name)[back] for field in fields(Solution)})


def _on_sample(
    problem: Problem, few: Problem, method: Method, settings: Any, seed: int, report: Report
) -> Solution:
    """Solve a problem on a sample of its directions, and go to the end on all."""
    solution, ends = _look(few, method, settings, seed, report)
    polished = finish(problem, ends, settings.polish)
    best, _ = _lowest(problem, polished)
    rows = np.arange(len(best))
    energy = polished.objective[rows, best]
    same = polished.objective <= np.maximum(energy * (1.0 + AS_LOW), EXACT)[:, None]
    return replace(
        solution,
        coordinates=polished.coordinates[rows, best],
        objective=energy,
        converged=polished.converged[rows, best],
        agreeing=np.where(same, ends.starts[:, : same.shape[1]], 0).sum(axis=1),
        evaluations=solution.evaluations + polished.evaluations.sum(axis=1),
    )


def _look(
    problem: Problem, method: Method, settings: Any, seed: int, report: Report
) -> tuple[Solution, Ends]:
    """Search and polish, once more where there is doubt; return the lowest different ends, too."""
    first, ends = _once(problem, method, settings, seed, report)
    again = np.flatnonzero(first.doubtful | ~first.converged | (first.agreeing < ENOUGH * first.starts))
    deeper = settings.deeper()
    if deeper is None or len(again) == 0:
        return first, ends
    second, more = _once(problem.take(again), method, deeper, seed, silent)
    for field in fields(Ends):
        getattr(ends, field.name)[again] = getattr(together([ends.take(again), more]), field.name)
    return _merged(first, second, again), ends


def joined(parts: Sequence[Solution]) -> Solution:
    """Return one solution for the wavelengths of several."""
    names = [field.name for field in fields(Solution)]
    return Solution(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def follow(problem_of: Callable[[npt.NDArray[np.intp]], Problem], solution: Solution) -> Solution:
    """Polish the ends of a solution in a problem that is near the one that it solves.

    `problem_of` gives the problem of some of the solution's wavelengths, by their places.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    parts = []
    every = np.arange(len(solution.objective))
    one = problem_of(every[:1])
    cost = 16 * one.size[1], FOLLOWED * len(one.seen.features)
    for block in wavelength_blocks(every, *cost):
        starts = solution.coordinates[block][:, None]
        ends = descend(problem_of(block), starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE)
        parts.append(ends)
    coordinates, objective, evaluations, converged = (
        np.concatenate([getattr(part, name)[:, 0] for part in parts])
        for name in ("coordinates", "objective", "evaluations", "converged")
    )
    return replace(
        solution,
        coordinates=coordinates,
        objective=objective,
        evaluations=solution.evaluations + evaluations,
        converged=converged,
    )


def _once(
    problem: Problem, method: Method, settings: Any, seed: int, report: Report
) -> tuple[Solution, Ends]:
    found = method.search(problem, settings, seed, report)
    everywhere = getattr(settings, "everywhere", False)
    polished = polish(
        problem, found.coordinates, settings.polish, found.first, found.rough_iterations, everywhere
    )
    best, agreeing = _lowest(problem, polished)
    rows = np.arange(len(best))
    coordinates, energy = polished.coordinates[rows, best], polished.objective[rows, best]
    spent = polished.evaluations.sum(axis=1)
    ends = lowest_ends(polished.coordinates, polished.objective)
    if found.off_limits:
        coordinates, energy, more, same = off_limits(problem, coordinates, energy)
        spent, agreeing = spent + more, np.where(same > 0, same, agreeing)
        ends = together([lowest_ends(coordinates[:, None], energy[:, None], same[:, None]), ends])
    solution = Solution(
        coordinates=coordinates,
        objective=energy,
        converged=polished.converged[rows, best],
        starts=np.full(len(best), found.coordinates.shape[1], dtype=np.int64),
        agreeing=agreeing,
        evaluations=found.evaluations + spent,
        not_finite=found.not_finite,
        acceptance=found.acceptance,
        doubtful=found.doubtful,
    )
    return solution, ends


def _lowest(problem: Problem, polished: Polished) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.int64]]:
    """Return the place of the lowest end (W,) and how many agree with it (W,).

    Of ends that differ by rounding alone, one that stands at fewer limits: where the data leave parameters
    open, it shows that better than one that the limits have stopped.
    """
    ends = np.where(np.isfinite(polished.objective), polished.objective, np.inf)
    lowest = ends.min(axis=1, keepdims=True)
    free = np.array(problem.free, dtype=np.intp)
    q = polished.coordinates[..., free]
    held = (q <= problem.lower[:, None, free]) | (q >= problem.upper[:, None, free])
    alike = ends <= np.maximum(lowest * (1.0 + ROUNDING), EXACT)
    limits = np.where(alike, held.sum(axis=-1), len(free) + 1)
    fewest = limits == limits.min(axis=1, keepdims=True)
    best = np.where(fewest, ends, np.inf).argmin(axis=1)
    level = np.maximum(lowest[:, 0] * (1.0 + AS_LOW), EXACT)
    return best, (ends <= level[:, None]).sum(axis=1)


def _merged(first: Solution, second: Solution, rows: npt.NDArray[np.intp]) -> Solution:
    """Return the first solution with what a second look at some rows added to it."""
    lower = second.objective < first.objective[rows]

    def chosen(name: str) -> Any:
        out = getattr(first, name).copy()
        out[rows[lower]] = getattr(second, name)[lower]
        return out

    def added(name: str) -> Any:
        out = getattr(first, name).copy()
        out[rows] += getattr(second, name)
        return out

    best = np.minimum(first.objective[rows], second.objective)
    level = np.maximum(best * (1.0 + AS_LOW), EXACT)
    agreeing = first.agreeing.copy()
    agreeing[rows] = np.where(first.objective[rows] <= level, agreeing[rows], 0)
    agreeing[rows] += np.where(second.objective <= level, second.agreeing, 0)
    return Solution(
        coordinates=chosen("coordinates"),
        objective=chosen("objective"),
        converged=chosen("converged"),
        starts=added("starts"),
        agreeing=agreeing,
        evaluations=added("evaluations"),
        not_finite=added("not_finite"),
        acceptance=first.acceptance,
        doubtful=first.doubtful,
    )

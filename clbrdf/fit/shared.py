"""Parameters that are one number for all wavelengths: a joint optimum over all of them.

What is minimised is the sum of (13) over directions and wavelengths,

    F = Σ_w Σ_n g_nw (f_nw(p_shared, p_w) − m_nw)² = Σ_w E_w Σ_n g_nw m_nw²,

with the weights g as they are given. Weights say how uncertain values are beside each other, and that holds
across wavelengths as within one: "sigma" makes F the χ² of all values; "relative" trusts all values alike to
a share of themselves; "none" trusts all alike in 1/sr, so that bright wavelengths count for more.

For given values of the shared parameters the wavelengths fall apart, and the others are fitted by the usual
search. F so becomes a function of the few shared coordinates alone, the profile. It is looked up on a grid (a
low-discrepancy set for more than two); from its lowest valleys a damped quasi-Newton walk leads
to a stationary point. The system of all coordinates is arrow-shaped: first curvature and error bars come from
the Schur complement of the blocks of the wavelengths.

Source: Björck, Numerical Methods for Least Squares Problems (1996), section 6.3 (block angular systems);
Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413 (the others eliminated).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.blocks import wavelength_blocks
from clbrdf.fit.lookup import LookupSettings
from clbrdf.fit.methods import METHODS, Method
from clbrdf.fit.normal_equations import normal_equations
from clbrdf.fit.polish import AS_LOW, EXACT, MOST_ITERATIONS, TOLERANCE, descend
from clbrdf.fit.problem import Problem
from clbrdf.fit.solve import Solution, joined, solve
from clbrdf.models import Model
from clbrdf.opencl.precision import get_precision
from clbrdf.progress import Report, silent

Array = npt.NDArray[np.float64]

GRID = {1: 32, 2: 12}
"""Values of each of one or two shared parameters; more are covered by SET points together."""
SET = 256

VALLEYS = 4
"""Of the profile, the lowest, that are walked down."""

QUICK = LookupSettings(shapes=256, starts=4, deepen=False, polish="single")
"""At a point of the grid: valleys differ by more than this search leaves open."""

MOST_STEPS = 100
MOST_LOOKS = 3
"""A look at the end of the walk, with the whole search, may find a lower optimum of some wavelength, from
where the walk goes on."""

STOP = 1e-13
"""Where a step would lower F by less than this, relative: next to rounding."""


def shared_names(model: Model, names: Sequence[str], given: Sequence[str]) -> tuple[str, ...]:
    """Return the full names of parameters that are to be shared, in the order of the table.

    Raises
    ------
    InputError
        A name that the model does not have, or several parts of it; a parameter that is fixed.
    """
    if isinstance(names, str):
        raise InputError(f"shared is the text {names!r}; give names in a tuple: shared=({names!r},)")
    full = {model.full_name(name) for name in names}
    for name in model.names:
        if name in full and name in given:
            raise InputError(f"parameter {name} is both fixed and shared; a fixed one is not fitted at all")
    return tuple(name for name in model.names if name in full)


@dataclass(frozen=True, eq=False)
class _Point:
    """The profile at some values of the shared coordinates: all coordinates (W, P), E (W,), F."""

    q: Array
    energy: Array
    converged: npt.NDArray[np.bool_]
    evaluations: npt.NDArray[np.int64]
    total: float


def solve_shared(
    problem: Problem,
    places: tuple[int, ...],
    norm: Array,
    method: Method,
    settings: Any,
    seed: int,
    report: Report,
) -> Solution:
    """Solve all wavelengths of a problem together.

    Parameters
    ----------
    problem : Problem
        All wavelengths, W; the shared parameters are free.
    places : tuple of int
        Of the shared parameters.
    norm : (W,) float64
        Σ g m², which turns E into its part of F; only ratios count.
    method : Method
    settings : object
        Of the method.
    seed : int
    report : callable

    Returns
    -------
    Solution
        With the same shared coordinates at all wavelengths. `starts` and `agreeing` count walks down valleys
        of the profile.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    profile = _Profile(problem, np.array(places), norm / norm.max(), method, settings, seed)
    grid = profile.grid()
    totals, spent = np.empty(len(grid)), np.zeros(problem.size[0], dtype=np.int64)
    steps = len(grid) + VALLEYS
    for k, s in enumerate(grid):
        point = profile.searched(s, METHODS["lookup"], QUICK)
        totals[k] = point.total
        spent += point.evaluations
        report(k + 1, steps)
    starts = grid[_valleys(grid, totals, profile.span)]
    ends = []
    for k, s in enumerate(starts):
        ends.append(profile.walked(s))
        spent += ends[-1].evaluations
        report(len(grid) + 1 + k, steps)
    report(steps, steps)
    best = min(ends, key=lambda end: end.total)
    level = max(best.total * (1.0 + AS_LOW), EXACT)
    w = problem.size[0]
    return Solution(
        coordinates=best.q,
        objective=best.energy,
        converged=best.converged,
        starts=np.full(w, len(ends), dtype=np.int64),
        agreeing=np.full(w, sum(end.total <= level for end in ends), dtype=np.int64),
        evaluations=spent,
        not_finite=np.zeros(w, dtype=np.int64),
        acceptance=np.full(w, np.nan),
        doubtful=np.zeros(w, dtype=np.bool_),
    )


def follow_shared(problem: Problem, places: tuple[int, ...], norm: Array, solution: Solution) -> Solution:
    """Walk from a solution to the bottom of its valley in a problem that is near the one that it solves.

    Parameters as of `solve_shared`.
    """
    profile = _Profile(problem, np.array(places), norm / norm.max(), METHODS["lookup"], QUICK, 0)
    start = _Point(solution.coordinates, solution.objective, solution.converged, solution.evaluations, 0.0)
    start = profile.followed(start, np.zeros_like(start.q), start.q[0, places])
    end, done = profile.descended(start)
    return replace(
        solution,
        coordinates=end.q,
        objective=end.energy,
        converged=end.converged & done,
        evaluations=end.evaluations,
    )


class _Profile:
    """F as a function of the shared coordinates, all others at their best."""

    def __init__(
        self, problem: Problem, places: npt.NDArray[np.intp], share: Array, way: Method, rules: Any, seed: int
    ) -> None:
        self.problem, self.places, self.share = problem, places, share
        self.way, self.rules, self.seed = way, rules, seed
        self.local = np.array([j for j in problem.free if j not in places], dtype=np.intp)
        self.lower, self.upper = problem.lower[0, places], problem.upper[0, places]
        self.span = self.upper - self.lower

    def grid(self) -> Array:
        """Points (K, S) that cover the limits."""
        d = len(self.places)
        if d in GRID:
            axis = (np.arange(GRID[d]) + 0.5) / GRID[d]
            unit = np.stack(np.meshgrid(*[axis] * d, indexing="ij"), axis=-1).reshape(-1, d)
        else:
            from scipy.stats import qmc

            unit = np.mod(qmc.Sobol(d, scramble=False).random(SET) + 0.5 / SET, 1.0)
        return np.asarray(self.lower + unit * self.span)

    def given(self, s: Array) -> Problem:
        """Return the problem with the shared coordinates given."""
        lower, upper = self.problem.lower.copy(), self.problem.upper.copy()
        lower[:, self.places], upper[:, self.places] = s, s
        return replace(self.problem, lower=lower, upper=upper, free=tuple(self.local.tolist()))

    def searched(self, s: Array, way: Method | None = None, rules: Any = None) -> _Point:
        """Search the others from nothing, by the fit's own method if no other is named."""
        problem = self.given(s)
        if not len(self.local):
            return self._judged(problem.lower, np.ones(self.problem.size[0], dtype=np.bool_), 0)
        way, rules = way or self.way, rules or self.rules
        w, n = problem.size
        blocks = wavelength_blocks(np.arange(w), *rules.cost(n, problem.lower.shape[1]))
        found = joined([solve(problem.take(b), way, rules, self.seed, silent) for b in blocks])
        total = float(self.share @ found.objective)
        return _Point(found.coordinates, found.objective, found.converged, found.evaluations, total)

    def followed(self, point: _Point, step: Array, s: Array) -> _Point:
        """Polish the others from where a step of the whole system leads them, and from where they are."""
        problem = self.given(s)
        if not len(self.local):
            return self._judged(problem.lower, point.converged, 0)
        starts = np.stack([point.q + step, point.q], axis=1)
        starts[..., self.places] = s
        starts = np.clip(starts, problem.lower[:, None], problem.upper[:, None])
        ends = descend(problem, starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE)
        energy = np.where(np.isfinite(ends.objective), ends.objective, np.inf)
        rows, best = np.arange(len(energy)), energy.argmin(axis=1)
        return _Point(
            ends.coordinates[rows, best],
            energy[rows, best],
            ends.converged[rows, best],
            point.evaluations + ends.evaluations.sum(axis=1),
            float(self.share @ energy[rows, best]),
        )

    def walked(self, s: Array) -> _Point:
        """Go from a point of the grid to the bottom of its valley."""
        point = self.searched(s)
        for look in range(MOST_LOOKS):
            point, done = self.descended(point)
            if not done:
                break
            again = self.searched(point.q[0, self.places])
            point = replace(point, evaluations=point.evaluations + again.evaluations)
            lower = again.energy < point.energy * (1.0 - 1e-9)
            if not lower.any() or look == MOST_LOOKS - 1:
                return point
            point = _Point(
                np.where(lower[:, None], again.q, point.q),
                np.where(lower, again.energy, point.energy),
                np.where(lower, again.converged, point.converged),
                point.evaluations,
                float(self.share @ np.where(lower, again.energy, point.energy)),
            )
        return replace(point, converged=np.zeros_like(point.converged))

    def descended(self, point: _Point) -> tuple[_Point, bool]:
        """Damped quasi-Newton on the profile, from JᵀJ; the end, and whether it is stationary.

        Where residuals are large, JᵀJ alone is far from the curvature, and its steps crawl.
        """
        damping = 1e-4
        pull, system, spread = self._reduced(point)
        for _ in range(MOST_STEPS):
            s = point.q[0, self.places]
            held = ((s <= self.lower) & (pull > 0.0)) | ((s >= self.upper) & (pull < 0.0))
            free = ~held
            if not free.any():
                return point, True
            step = np.zeros(len(s))
            diagonal = np.maximum(np.diagonal(system), 1e-290)
            root = np.sqrt(np.where(free, diagonal, 1.0))
            scaled = system / root[:, None] / root
            damped = (scaled + damping * np.eye(len(s)))[np.ix_(free, free)]
            step[free] = -np.linalg.lstsq(damped, (pull / root)[free], rcond=1e-14)[0] / root[free]
            predicted = float(-(step @ pull))
            if predicted <= STOP * point.total or point.total <= EXACT:
                return point, True
            step = np.clip(step, -0.25 * self.span, 0.25 * self.span)
            trial_s = np.clip(s + step, self.lower, self.upper)
            trial = self.followed(point, spread(trial_s - s), trial_s)
            if trial.total < point.total:
                before, moved = pull, trial_s - s
                point, damping = trial, max(damping / 5.0, 1e-12)
                pull, fresh, spread = self._reduced(point)
                system = updated(system, moved, pull - before, fresh)
            else:
                point = replace(point, evaluations=trial.evaluations)
                damping *= 10.0
                if damping > 1e8:
                    return point, True
        return point, False

    def _reduced(self, point: _Point) -> tuple[Array, Array, Callable[[Array], Array]]:
        """Half the gradient of F (S,) and JᵀJ (S, S), the others eliminated; and how those follow a step."""
        _, h, H = normal_equations(self.problem, point.q)
        h, H = h * self.share[:, None], H * self.share[:, None, None]
        local, places = self.local, self.places
        inside = (point.q > self.problem.lower) & (point.q < self.problem.upper)
        A, B = H[:, local[:, None], local], H[:, local[:, None], places]
        inverse = inverse_of(A, inside[:, local])
        follow = inverse @ B  # (W, L, S)
        pull = h[:, places].sum(axis=0) - np.einsum("wls,wl->s", follow, h[:, local])
        system = H[:, places[:, None], places].sum(axis=0) - np.einsum("wls,wlt->st", B, follow)

        def spread(step: Array) -> Array:
            out = np.zeros_like(point.q)
            out[:, local] = -(follow @ step)
            return out

        return pull, system, spread

    def _judged(self, q: Array, converged: npt.NDArray[np.bool_], spent: int) -> _Point:
        """Where there are no others."""
        energy, _, _ = normal_equations(self.problem, q)
        evaluations = np.full(len(q), spent + 1, dtype=np.int64)
        return _Point(q.copy(), energy, converged, evaluations, float(self.share @ energy))


def updated(system: Array, step: Array, change: Array, fresh: Array) -> Array:
    """Return the curvature (S, S) after a step and its change of half the gradient: BFGS, else JᵀJ."""
    along = system @ step
    told, known = float(step @ change), float(step @ along)
    if not (known > 0.0 and told > 1e-3 * known):
        return fresh
    return np.asarray(system + np.outer(change, change) / told - np.outer(along, along) / known)


LEAST_EIGENVALUE = 1e-13
"""Of blocks scaled to a unit diagonal: below it rounding hides the direction, and nothing moves along it."""


def inverse_of(blocks: Array, free: npt.NDArray[np.bool_]) -> Array:
    """Return inverses (W, L, L) of positive blocks over what is free (W, L).

    Directions that rounding hides are left out.
    """
    diagonal = np.diagonal(blocks, axis1=1, axis2=2)
    usable = free & (diagonal > 0.0)
    scale = np.where(usable, 1.0 / np.sqrt(np.where(usable, diagonal, 1.0)), 0.0)
    across = scale[:, :, None] * scale[:, None, :]
    values, vectors = np.linalg.eigh(blocks * across + np.eye(blocks.shape[1]) * ~usable[:, :, None])
    kept = values > LEAST_EIGENVALUE
    inverse = (vectors * np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)[:, None, :]) @ np.swapaxes(
        vectors, 1, 2
    )
    out: Array = inverse * across
    return out


def _valleys(grid: Array, totals: Array, span: Array) -> npt.NDArray[np.intp]:
    """Places of points that are lower than all near them, the lowest first."""
    totals = np.nan_to_num(totals, nan=np.inf)
    unit = grid / np.where(span > 0.0, span, 1.0)
    d, count = unit.shape[1], len(unit)
    near = 1.5 / (GRID[d] if d in GRID else count ** (1.0 / d))
    apart = np.abs(unit[:, None] - unit[None]).max(axis=-1)
    beside = np.where(apart <= near, totals[None], np.inf)
    lowest = np.flatnonzero(totals <= beside.min(axis=1))
    return lowest[np.argsort(totals[lowest], kind="stable")][:VALLEYS]

"""Profile-likelihood intervals: how far a parameter may move while the others make the best of it.

With the value of one parameter given and all others at their best, F = Σ g r² becomes a function of that
value alone. The interval holds the values for which F exceeds its minimum by at most c: where the weights are
1/σ², c = 1; in general it is the ratio of the parameter's variance (`uncertainty.py`, all parameters free) to
its element of (JᵀGJ)⁻¹, so that near the optimum the interval is the value ± one standard uncertainty. It
need not be symmetric, it ends at a limit of the parameter, and it counts what other parameters do when they
leave their limits, which uncertainties with those held do not.

√((F − F_min)/c) is nearly linear in the value, and a few steps of the secant find where it is 1. All
wavelengths and both ends are columns of one batch of the polish.

Sources: Venzon and Moolgavkar, Appl. Statist. 37 (1988), doi:10.2307/2347496; Kent, Biometrika 69 (1982),
doi:10.1093/biomet/69.1.19 (weights that are not 1/σ²).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.polish import MOST_ITERATIONS, TOLERANCE, descend
from clbrdf.fit.problem import Problem
from clbrdf.opencl.precision import get_precision

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MOST_STEPS = 24
ENOUGH = 2e-3
"""The end of an interval is found to this share of its half-width, far below the second digit."""

FIRST_STEP = 1e-2
"""Of the range between the limits, where no uncertainty says how far to go first."""


def profile_intervals(problem: Problem, best: Array, rise: Array, deviation: Array) -> tuple[Array, Array]:
    """Return lower and upper ends (W, P) of the intervals, in coordinates; NaN where there is none.

    Parameters
    ----------
    problem : Problem
        W wavelengths.
    best : (W, P) float64
        Coordinates of the optimum.
    rise : (W, P) float64
        By how much E may rise for each parameter; no interval where it is not finite and positive.
    deviation : (W, P) float64
        Standard uncertainties of the coordinates, of which the first step is made where they are finite.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernels.
    """
    ends = np.full((2, *best.shape), np.nan)
    for j in problem.free:
        rows = np.flatnonzero(np.isfinite(rise[:, j]) & (rise[:, j] > 0.0) & np.isfinite(best).all(axis=1))
        if len(rows):
            found = _ends(problem.take(rows), best[rows], j, rise[rows, j], deviation[rows, j])
            ends[:, rows, j] = found
    return ends[0], ends[1]


def _ends(problem: Problem, best: Array, j: int, rise: Array, deviation: Array) -> Array:
    """Return both ends (2, W) of the interval of one coordinate."""
    w = len(best)
    # Row k of what follows is the lower end of wavelength k, row W + k the upper one.
    rows, side = np.tile(np.arange(w), 2), np.repeat([-1.0, 1.0], w)
    middle = best[rows, j]
    limit = np.where(side < 0.0, problem.lower[rows, j], problem.upper[rows, j])
    span = (problem.upper - problem.lower)[rows, j]
    step = np.where(
        np.isfinite(deviation[rows]) & (deviation[rows] > 0.0), deviation[rows], FIRST_STEP * span
    )
    profile = _Profile(problem, best, j)
    lowest = profile.energy(np.arange(w), best[:, j], best)[0]
    inner, inner_root, inner_q = middle.copy(), np.zeros(2 * w), best[rows].copy()
    outer, outer_root = np.full((2, 2 * w), np.nan)
    end = np.where(middle == limit, limit, np.nan)
    trial, kept = _towards(middle + side * step, limit, side), np.zeros(2 * w, dtype=np.int64)
    for _ in range(MOST_STEPS):
        active = np.flatnonzero(np.isnan(end))
        if not len(active):
            break
        x = trial[active]
        energy, q = profile.energy(rows[active], x, inner_q[active])
        root = np.sqrt(np.maximum(energy - lowest[rows[active]], 0.0) / rise[rows[active]])
        done = np.abs(root - 1.0) < ENOUGH
        done |= (root < 1.0) & (x == limit[active])
        end[active[done]] = x[done]
        inside = root < 1.0
        one, other = active[inside], active[~inside]
        inner[one], inner_root[one], inner_q[one] = x[inside], root[inside], q[inside]
        outer[other], outer_root[other] = x[~inside], root[~inside]
        # The same side again and again: halve the bracket instead.
        kept[active] = np.where(inside, np.maximum(kept[active], 0) + 1, np.minimum(kept[active], 0) - 1)
        a, b, ra, rb = (v[active] for v in (inner, outer, inner_root, outer_root))
        with np.errstate(invalid="ignore", divide="ignore"):
            secant = a + (1.0 - ra) * (b - a) / (rb - ra)
            stretched = middle[active] + (x - middle[active]) * np.clip(1.05 / root, 1.2, 8.0)
        secant = np.where(np.isfinite(secant) & (np.abs(kept[active]) < 3), secant, 0.5 * (a + b))
        trial[active] = _towards(np.where(np.isnan(b), stretched, secant), limit[active], side[active])
    # What no step has closed ends where it is known to be too far.
    open_ends = np.isnan(end)
    end[open_ends] = np.where(np.isfinite(outer), outer, limit)[open_ends]
    return end.reshape(2, w)


def _towards(x: Array, limit: Array, side: Array) -> Array:
    """Return values on the way to a limit, none beyond it."""
    return np.where(side < 0.0, np.maximum(x, limit), np.minimum(x, limit))


class _Profile:
    """E as a function of one coordinate, all others at their best."""

    def __init__(self, problem: Problem, best: Array, j: int) -> None:
        self.problem, self.best, self.j = problem, best, j
        self.others = tuple(k for k in problem.free if k != j)

    def energy(self, rows: npt.NDArray[np.intp], x: Array, near: Array) -> tuple[Array, Array]:
        """Return E (K,) and all coordinates (K, P) where the coordinate is x (K,), at the wavelengths `rows`.

        The others start at the optimum, and at `near` (K, P).
        """
        part = self.problem.take(rows)
        lower, upper = part.lower.copy(), part.upper.copy()
        lower[:, self.j], upper[:, self.j] = x, x
        given = replace(part, lower=lower, upper=upper, free=self.others)
        starts = np.clip(np.stack([near, self.best[rows]], axis=1), lower[:, None], upper[:, None])
        if not self.others:
            from clbrdf.fit.normal_equations import normal_equations

            return normal_equations(given, starts[:, 0])[0], starts[:, 0]
        ends = descend(given, starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE)
        energy = np.where(np.isfinite(ends.objective), ends.objective, np.inf)
        lowest, which = np.arange(len(rows)), energy.argmin(axis=1)
        return energy[lowest, which], ends.coordinates[lowest, which]

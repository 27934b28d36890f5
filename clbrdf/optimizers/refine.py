"""From a good point to a stationary one: SciPy's bounded least squares in fp64 with analytic derivatives."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.optimizers.objective import HUGE, Objective

Array = npt.NDArray[np.float64]

TOLERANCE = 1e-15
"""Relative change of E and q below which the solvers stop: rounding."""

INSIDE = 1e-12
"""Share of the range by which a start is moved off its limits: the first solver needs an interior."""


def refine(objective: Objective, start: Array, evaluations: int = 400) -> tuple[Array, float, int]:
    """Return the lowest point found from a start, its E, and the passes over the directions it took.

    Two solvers in turn: a reflective trust region, which passes through valleys, then a rectangular one,
    which settles on limits exactly.

    Parameters
    ----------
    objective : Objective
    start : (P,) float64
        Coordinates.
    evaluations : int
        Most passes of each solver.
    """
    from scipy.optimize import least_squares

    span = objective.upper - objective.lower
    bounds = (objective.lower, objective.upper)
    best, lowest, spent = start, objective.value_and_gradient(start)[0], 1

    def residuals(q: Array) -> Array:
        return np.clip(np.nan_to_num(objective.residuals(q)[0], nan=HUGE), -HUGE, HUGE)

    def jacobian(q: Array) -> Array:
        return np.clip(np.nan_to_num(objective.residuals(q)[1]), -HUGE, HUGE)

    for method in ("trf", "dogbox"):
        inside = np.clip(best, objective.lower + INSIDE * span, objective.upper - INSIDE * span)
        with np.errstate(all="ignore"):
            end = least_squares(
                residuals,
                inside if method == "trf" else best,
                jac=jacobian,
                bounds=bounds,
                method=method,
                x_scale="jac",
                max_nfev=evaluations,
                ftol=TOLERANCE,
                xtol=TOLERANCE,
                gtol=TOLERANCE,
            )
        spent += int(end.nfev) + int(end.njev or 0)
        q = np.clip(end.x, *bounds)
        E = objective.value_and_gradient(q)[0]
        if lowest > E:
            best, lowest = q, E
    return best, lowest, spent

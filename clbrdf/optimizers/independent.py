"""Two independent ways to the global optimum, which share the objective and nothing else.

    least-squares   random starts in all coordinates, each to its end along the analytic Jacobian
    evolution       no gradient: populations over the nonlinear coordinates, the linear ones solved inside,
                    from the start again whenever a population has become one point

Each search ends in `refine`. They were chosen by measurement on the problem set (docs/decisions/0041); the
lower end of both is what counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from clbrdf.optimizers import Optimizer, evolution, minimise
from clbrdf.optimizers.objective import NumpyObjective, Values
from clbrdf.optimizers.refine import refine
from clbrdf.optimizers.separable import SeparableObjective

Array = npt.NDArray[np.float64]

EVALUATIONS = {"least-squares": 6_000, "evolution": 60_000}
"""Budgets; one to two seconds a wavelength each on one core, for 260 directions."""

POPULATIONS = Optimizer("evolution", "populations, again and again", partial(evolution.run, same=1e-6))
"""A population counts as one point early, so that the budget is enough for eight of them."""


@dataclass(frozen=True, eq=False)
class Found:
    """Where one search ended.

    Attributes
    ----------
    optimizer : str
        A key of EVALUATIONS.
    coordinates : (P,) float64
    objective : float
        E there.
    evaluations : int
    """

    optimizer: str
    coordinates: Array
    objective: float
    evaluations: int


def search_twice(objective: NumpyObjective, seed: int = 0, effort: float = 1.0) -> tuple[Found, Found]:
    """Search an optimum in both ways.

    Parameters
    ----------
    objective : NumpyObjective
    seed : int
    effort : float
        Factor on the budgets.
    """
    first = minimise(
        "least-squares",
        objective,
        evaluations=max(1, round(effort * EVALUATIONS["least-squares"])),
        seed=seed,
    )
    separable = SeparableObjective(objective) if objective.linear else None
    reduced: Values = separable or objective
    second = minimise(
        POPULATIONS, reduced, evaluations=max(1, round(effort * EVALUATIONS["evolution"])), seed=seed
    )
    ends = (first.coordinates, separable.complete(second.coordinates) if separable else second.coordinates)
    found = []
    for trace, start in zip((first, second), ends, strict=True):
        q, E, spent = refine(objective, start)
        found.append(Found(trace.optimizer, q, E, trace.spent + spent))
    return found[0], found[1]

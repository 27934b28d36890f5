"""Two independent ways to the global optimum, which share the objective and nothing else.

    least-squares   random starts in all coordinates, each to its end along the analytic Jacobian
    evolution       no gradient: populations over the nonlinear coordinates, the linear ones solved inside,
                    from the start again whenever a population has become one point; where all are linear,
                    solved at once

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
class SearchedOptimum:
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


def search_twice(
    objective: NumpyObjective, seed: int = 0, effort: float = 1.0
) -> tuple[SearchedOptimum, SearchedOptimum]:
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
    ends = [(first.optimizer, first.coordinates, first.spent)]
    if len(objective.linear) == len(objective.lower):
        ends.append((POPULATIONS.name, _linear_solution(objective), 1))
    else:
        separable = SeparableObjective(objective) if objective.linear else None
        reduced: Values = separable or objective
        budget = max(1, round(effort * EVALUATIONS["evolution"]))
        second = minimise(POPULATIONS, reduced, evaluations=budget, seed=seed)
        q = separable.complete(second.coordinates) if separable else second.coordinates
        ends.append((second.optimizer, q, second.spent))
    found = []
    for name, start, before in ends:
        q, E, spent = refine(objective, start)
        found.append(SearchedOptimum(name, q, E, before + spent))
    return found[0], found[1]


def _linear_solution(objective: NumpyObjective) -> Array:
    """Where nothing is left to search: the one optimum, by SciPy's bounded linear least squares."""
    from scipy.optimize import lsq_linear

    rows = [objective.model.parameters[j] for j in objective.coordinates.free]
    ends = objective.coordinates.values(np.stack([objective.lower, objective.upper]))
    limits = np.sort(ends[:, objective.coordinates.free], axis=0)
    parameters = objective.coordinates.values(objective.lower)
    parameters[objective.coordinates.free] = 0.0
    rest = objective.target - objective.scale * objective.seen.brdf(parameters[None, :])
    columns = objective.seen.jacobian(parameters[None, :])[:, objective.coordinates.free]
    columns = columns * objective.scale[:, None]
    length = np.linalg.norm(columns, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    solution = (
        lsq_linear(columns / length, rest, (limits[0] * length, limits[1] * length), tol=1e-15).x / length
    )
    q = np.array([float(row.to_coordinate(value)) for row, value in zip(rows, solution, strict=True)])
    return np.asarray(np.clip(q, objective.lower, objective.upper))

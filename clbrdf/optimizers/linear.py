"""Which parameters of a model enter linearly, found from its derivatives.

f is linear in a set of parameters where their columns of the Jacobian do not change with any of them. With
the others held, the best values then solve a small linear least-squares problem (variable projection: Golub
and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from clbrdf.geometry import Directions
from clbrdf.models import Model

SAME = 1e-12
"""Relative; columns that differ by less are the same but for rounding."""

FACTORS = (0.5, 2.0, 3.0, 0.25, 1.5)
"""By which parameters of the set are changed, each in turn another."""


@cache
def linear_parameters(model: Model) -> tuple[int, ...]:
    """Return the places of the largest leading set of parameters in which f is linear, without offset.

    f = Σ p_j ∂f/∂p_j over the set, whatever the others are; empty where there is no such set.
    """
    directions = Directions(np.array([20.0, 45.0, 60.0]), np.array([15.0, 50.0, 70.0]), np.full(1, 160.0))
    x, base = model.features(directions), model.vector({})
    chosen: list[int] = []
    for j in range(len(base)):
        trial = [*chosen, j]
        if all(_same_columns(model, x, base, trial, shift) for shift in range(len(FACTORS))):
            chosen = trial
    columns = model.jacobian(base[None, :], x)[:, chosen]
    whole = np.allclose(columns @ base[chosen], model.brdf(base[None, :], x), rtol=SAME, atol=0.0)
    return tuple(chosen) if whole else ()


def _same_columns(model: Model, x: np.ndarray, base: np.ndarray, places: list[int], shift: int) -> bool:
    changed = base.copy()
    for k, place in enumerate(places):
        changed[place] *= FACTORS[(k + shift) % len(FACTORS)]
    before, after = (model.jacobian(p[None, :], x)[:, places] for p in (base, changed))
    return bool(np.allclose(before, after, rtol=SAME, atol=0.0))

"""A model with terms left out: a smaller model of its own, whose kernel has no code for what is missing.

On the host the rest is evaluated by the whole model with neutral values in place of what is missing
(a = 0 makes F = 1, k_d = 0 removes the diffuse part); in the kernel the lines of a term are left out of the
source (`clbrdf.program`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial

import numpy as np
import numpy.typing as npt

from clbrdf.models import get_model
from clbrdf.models.model import Model

Array = npt.NDArray[np.float64]


def get_restricted(name: str, left_out: frozenset[str] = frozenset()) -> Model:
    """Return the model of a name without some of its terms.

    Raises
    ------
    InputError
        No model has this name.
    """
    model = get_model(name)
    return restrict(model, left_out) if left_out else model


@cache
def restrict(model: Model, left_out: frozenset[str]) -> Model:
    """Return a model without some of its terms; a factor goes with the summand that it belongs to.

    Parameters and features that only a missing term takes are gone from the tables.
    """
    gone = frozenset(t.name for t in model.terms if t.name in left_out or t.factor_of in left_out)
    if not gone:
        return model
    missing = [term for term in model.terms if term.name in gone]
    neutral = {name: value for term in missing for name, value in term.neutral}
    absent = {name for term in missing for name in term.features}
    kept = [j for j, name in enumerate(model.names) if name not in neutral]
    seen = [j for j, name in enumerate(model.feature_names) if name not in absent]
    filling = np.array([neutral.get(name, 0.0) for name in model.names])

    def whole(parameters: Array) -> Array:
        out = np.broadcast_to(filling, (*parameters.shape[:-1], len(filling))).copy()
        out[..., kept] = parameters
        return out

    def spread(x: Array) -> Array:
        out = np.zeros((len(x), len(model.feature_names)))
        out[:, seen] = x
        return out

    def reference(parameters: Array, theta_i: float, theta_r: float, phi: float) -> object:
        return model.reference(whole(parameters), theta_i, theta_r, phi, left_out=gone)

    return replace(
        model,
        parameters=tuple(model.parameters[j] for j in kept),
        feature_names=tuple(model.feature_names[j] for j in seen),
        incident_features=sum(j < model.incident_features for j in seen),
        features=partial(model.features, left_out=gone),
        brdf=lambda parameters, x: model.brdf(whole(parameters), spread(x)),
        jacobian=lambda parameters, x: model.jacobian(whole(parameters), spread(x))[..., kept],
        derived=lambda parameters: model.derived(whole(parameters))[..., kept],
        reference=reference,
        structure=None,
        terms=tuple(term for term in model.terms if term.name not in gone),
        left_out=gone,
    )

"""A ranking in a fit file: the group `choice` of its entry, beside what `Fit` writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.choose.candidates import Skipped
from clbrdf.fit.result import Fit
from clbrdf.models import get_model
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py

    from clbrdf.choose.result import Choice

GROUP = "choice"

NUMBERS = {
    "predicted": "relative deviation of what was predicted, root mean square",
    "above": "mean score less that of the best model",
    "standard_error": "of this paired difference",
    "relative_rms": "σ_r of (14), median over wavelengths",
    "aicc": "AICc",
    "bic": "BIC",
    "chi2_reduced": "reduced chi-squared",
    "lag_one": "correlation of neighbouring residuals along θr",
    "exchange": "largest factor by which exchanging source and detector changes the BRDF",
    "reflectance": "largest directional-hemispherical reflectance",
}
"""Of a model: numbers without a unit that go to the file under their own names, (M,)."""


def write(choice: Choice, group: h5py.Group) -> None:
    """Write all but the fit into an empty group."""
    group["program"] = "clbrdf"
    for name in ("chosen", "verdict", "weights"):
        group[name] = getattr(choice, name)
    group["misfit"], group["thin"] = list(choice.misfit), list(choice.thin)
    group["models"] = [row.model for row in choice.ranking]
    group["skipped"] = [row.model for row in choice.skipped]
    group["skipped_because"] = [row.reason for row in choice.skipped]
    hdf5.field(group, "theta_i", choice.theta_i, "deg", "incident zeniths left out in turn")
    hdf5.field(
        group, "places", choice.places.astype(np.int64), "", "wavelengths of the ranking, their places"
    )
    hdf5.field(group, "free", np.array([row.free for row in choice.ranking], dtype=np.int64), "")
    hdf5.field(group, "within", np.array([row.within for row in choice.ranking], dtype=np.uint8), "")
    for name, meaning in NUMBERS.items():
        hdf5.field(group, name, np.array([getattr(row, name) for row in choice.ranking]), "1", meaning)
    hdf5.field(group, "cut", np.array([row.cut for row in choice.ranking]), "deg", "end of that integral")
    scores = np.stack([row.score for row in choice.ranking])
    hdf5.field(group, "score", scores, "1", "of each model, incident angle and wavelength, when left out")
    means = np.stack([row.mean_residual for row in choice.ranking])
    hdf5.field(group, "mean_residual", means, "1", "relative, of each model and incident angle")
    for row in choice.ranking:
        fitted = hdf5.group(group, f"parameters_{row.model.replace('/', '_')}", "NXcollection")
        for parameter in get_model(row.model, force=True).parameters:
            values = row.parameters[parameter.name]
            hdf5.field(fitted, parameter.name, values, parameter.unit, parameter.meaning)


def read(choice: Callable[..., Choice], ranked: Callable[..., Any], fit: Fit, group: h5py.Group) -> Choice:
    """Read what `write` wrote, as records of the types given."""
    ranking = []
    for k, model in enumerate(_texts(group, "models")):
        fitted = group[f"parameters_{model.replace('/', '_')}"]
        ranking.append(
            ranked(
                model=model,
                free=int(group["free"][k]),
                within=bool(group["within"][k]),
                cut=float(group["cut"][k]),
                score=group["score"][k],
                mean_residual=group["mean_residual"][k],
                parameters={name: fitted[name][()] for name in fitted},
                **{name: float(group[name][k]) for name in NUMBERS},
            )
        )
    reasons = _texts(group, "skipped_because")
    return choice(
        ranking=tuple(ranking),
        fit=fit,
        theta_i=group["theta_i"][()],
        places=group["places"][()].astype(np.intp),
        skipped=tuple(Skipped(*pair) for pair in zip(_texts(group, "skipped"), reasons, strict=True)),
        misfit=_texts(group, "misfit"),
        thin=_texts(group, "thin"),
        **{name: hdf5.read_text(group, name) for name in ("chosen", "verdict", "weights")},
    )


def _texts(group: h5py.Group, name: str) -> tuple[str, ...]:
    """Read a list of strings; an empty one has no type of its own."""
    values = group[name][()]
    return tuple(text.decode() for text in values) if values.dtype == object else ()

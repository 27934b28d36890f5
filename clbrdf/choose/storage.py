"""A ranking in a fit file: the group `choice` of its entry, beside what `Fit` writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.choose.candidates import Skipped
from clbrdf.errors import InputError, shortened
from clbrdf.fit.result import Fit
from clbrdf.models import get_model
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, check_group, clean, read_items, read_texts, text_attribute

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

SCHEMA = (
    Item("theta_i", ("A",), units.ANGLE),
    Item("places", ("W",), kind="whole"),
    Item("free", ("M",), kind="whole"),
    Item("within", ("M",), kind="truth"),
    *(Item(name, ("M",), units.COUNTLESS) for name in NUMBERS),
    Item("cut", ("M",), units.ANGLE),
    Item("score", ("M", "A", "W"), units.COUNTLESS),
    Item("mean_residual", ("M", "A"), units.COUNTLESS),
)
"""Arrays of M models, A incident angles, W wavelengths of the ranking."""


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
    """Read what `write` wrote, as records of the types given.

    Raises
    ------
    InputError
        Arrays that do not belong together, or of another type or unit.
    KeyError
        Something is missing.
    """
    models = read_texts(group, "models")
    if not models:
        raise InputError(f"{group.name}/models is empty; the file is damaged, make it again")
    arrays = read_items(group, SCHEMA, {"M": len(models)})
    places = arrays["places"]
    count, lengths = len(fit.wavelength), {"W": len(places)}
    if len(places) == 0 or places.min() < 0 or places.max() >= count:
        raise InputError(f"{group.name}/places holds wavelengths that the scan of {count} does not have")
    ranking = []
    for k, model in enumerate(models):
        fitted = group[f"parameters_{model.replace('/', '_')}"]
        check_group(fitted)
        items = [
            Item(name, ("W",), units.same_as(text_attribute(fitted[name], "units")))
            for name in (clean(each) for each in fitted)
        ]
        ranking.append(
            ranked(
                model=model,
                free=int(arrays["free"][k]),
                within=bool(arrays["within"][k]),
                cut=float(arrays["cut"][k]),
                score=arrays["score"][k],
                mean_residual=arrays["mean_residual"][k],
                parameters=read_items(fitted, items, lengths),
                **{name: float(arrays[name][k]) for name in NUMBERS},
            )
        )
    skipped = read_texts(group, "skipped")
    reasons = read_texts(group, "skipped_because", len(skipped))
    chosen = hdf5.read_text(group, "chosen")
    if chosen not in models:
        raise InputError(f"{group.name}/chosen is {shortened(repr(chosen))}, which is not in the ranking")
    return choice(
        ranking=tuple(ranking),
        fit=fit,
        theta_i=arrays["theta_i"],
        places=places.astype(np.intp),
        skipped=tuple(Skipped(*pair) for pair in zip(skipped, reasons, strict=True)),
        misfit=read_texts(group, "misfit"),
        thin=read_texts(group, "thin"),
        chosen=chosen,
        **{name: hdf5.read_text(group, name) for name in ("verdict", "weights")},
    )

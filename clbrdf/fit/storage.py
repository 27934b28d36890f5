"""A fit in an HDF5 file: the group `fit` of an entry, beside the scan."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.carried import Part
from clbrdf.fit.montecarlo import MonteCarlo
from clbrdf.fit.records import STATUSES, Estimate, Goodness, Search, Setup
from clbrdf.fit.words import remarks_line
from clbrdf.models import Model, remade
from clbrdf.scan import Scan
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py

    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]

ESTIMATE = ("correlation", "condition")
GOODNESS = ("objective", "relative_rms", "relative_rms_by_incident_angle")
SEARCH = ("evaluations", "starts", "agreeing", "acceptance", "not_finite")
SETUP = ("weights", "bounds")
"""Arrays of each record that go to the file under their own names."""

MONTE_CARLO = ("intervals", "median", "at_bound", "converged")

MASKS = ("at_bound", "undetermined")
"""Of the estimate, (W, P) as 0 and 1; files before version 0.2 do not hold them."""


def write(fit: Fit, group: h5py.Group) -> None:
    """Write all but the scan into an empty group."""
    setup, estimate = fit.setup, fit.estimate
    group["program"] = "clbrdf"
    group["method"], group["device"] = setup.method, fit.search.device
    group["model"] = fit.model.name
    group["given"], group["shared"] = list(fit.given), list(fit.shared)
    group["seed"] = setup.seed
    group["gls"] = setup.gls
    group["weighting"], group["left_out"] = setup.weighting, setup.left_out
    for name in ("smooth", "rtol"):
        value = getattr(setup, name)
        hdf5.field(group, name, np.array(math.nan if value is None else float(value)), "1")
    data = hdf5.group(group, "parameters", "NXdata")
    keys = [_key(name) for name in fit.model.names]
    data.attrs["signal"], data.attrs["auxiliary_signals"] = keys[0], keys[1:]
    data.attrs["axes"] = ["wavelength"]
    hdf5.field(data, "wavelength", fit.wavelength, "nm", "wavelength")
    for j, row in enumerate(fit.model.parameters):
        key = _key(row.name)
        hdf5.field(data, key, estimate.vector[:, j], row.unit, row.meaning)
        hdf5.field(data, f"{key}_errors", estimate.sigma[:, j], row.unit, f"1σ of {row.name}")
    hdf5.field(group, "incident_angles", fit.scan.incident_angles, "deg", "rows of σ_r by incident zenith")
    codes = np.array([STATUSES.index(str(s)) for s in fit.status], dtype=np.uint8)
    hdf5.field(group, "status", codes, "").attrs["names"] = list(STATUSES)
    for record, names in (
        (fit.goodness, GOODNESS),
        (estimate, ESTIMATE),
        (fit.search, SEARCH),
        (setup, SETUP),
    ):
        for name in names:
            hdf5.field(group, name, getattr(record, name), "1")
    for name in MASKS:
        hdf5.field(group, name, getattr(estimate, name).astype(np.uint8), "")
    parts = hdf5.group(group, "uncertainty", "NXcollection")
    for k, part in enumerate(estimate.parts):
        one = hdf5.group(parts, f"part_{k}", "NXcollection")
        one["name"], one["words"], one["is_common"] = part.name, part.words, part.is_common
        hdf5.field(one, "own", part.own, "1", "covariance at each wavelength by itself")
        hdf5.field(one, "modes", part.modes, "1", "errors that wavelengths have in common")
    if fit.monte_carlo is not None:
        drawn = hdf5.group(group, "monte_carlo", "NXcollection")
        drawn["draws"], drawn["seed"] = fit.monte_carlo.draws, fit.monte_carlo.seed
        for name in MONTE_CARLO:
            hdf5.field(drawn, name, getattr(fit.monte_carlo, name), "1")
        hdf5.field(drawn, "departs", fit.monte_carlo.departs.astype(np.uint8), "")
    # For readers of the file: the program finds remarks anew from the numbers.
    group["remarks"] = [remarks_line(remarks) for remarks in fit.remarks]
    hdf5.write_mapping(group, "provenance", fit.provenance)


def read(entry: h5py.Group) -> dict[str, Any]:
    """Read what `write` wrote, or an earlier version did, as the arguments of a Fit."""
    group = entry["fit"]
    data = group["parameters"]
    model = _model_of(hdf5.read_text(group, "model"), data)
    names = [str(name) for name in group["status"].attrs["names"]]
    provenance = hdf5.read_mapping(group, "provenance")
    vector = np.stack([data[_key(name)][()] for name in model.names], axis=1)
    return {
        "scan": Scan.read(entry),
        "model": model,
        "setup": _setup(group, model, vector, provenance),
        "estimate": _estimate(group, model, vector),
        "goodness": Goodness(**{name: group[name][()] for name in GOODNESS}),
        "search": Search(hdf5.read_text(group, "device"), *(group[name][()] for name in SEARCH)),
        "status": np.array([names[code] for code in group["status"][()]]),
        "provenance": provenance,
        "monte_carlo": _monte_carlo(group),
    }


def _monte_carlo(group: h5py.Group) -> MonteCarlo | None:
    if "monte_carlo" not in group:
        return None
    drawn = group["monte_carlo"]
    arrays = {name: drawn[name][()] for name in MONTE_CARLO}
    return MonteCarlo(
        int(drawn["draws"][()]), int(drawn["seed"][()]), **arrays, departs=drawn["departs"][()] > 0
    )


def _setup(group: h5py.Group, model: Model, vector: Array, provenance: dict[str, str]) -> Setup:
    given = _names(group, "given")
    if "weighting" in group:
        values = {name: float(group[name][()]) for name in ("smooth", "rtol")}
        told: dict[str, Any] = {name: None if math.isnan(v) else v for name, v in values.items()}
        weighting, left_out = hdf5.read_text(group, "weighting"), int(group["left_out"][()])
    else:  # before version 0.2 only the provenance told it
        told = {name: float(provenance[name]) if name in provenance else None for name in ("smooth", "rtol")}
        named = provenance.get("weights", "")
        weighting = named if named in ("none", "relative", "sigma") else "user"
        left_out = int(provenance.get("left_out", "0").split()[0])
    return Setup(
        weighting=weighting,
        left_out=left_out,
        fixed={name: vector[:, model.names.index(name)].copy() for name in given},
        shared=_names(group, "shared"),
        method=hdf5.read_text(group, "method"),
        seed=int(group["seed"][()]),
        gls=bool(group["gls"][()]) if "gls" in group else False,
        **told,
        **{name: group[name][()] for name in SETUP},
    )


def _estimate(group: h5py.Group, model: Model, vector: Array) -> Estimate:
    data, given = group["parameters"], _names(group, "given")
    sigma = np.stack([data[f"{_key(name)}_errors"][()] for name in model.names], axis=1)
    arrays = {name: group[name][()] for name in ESTIMATE}
    if MASKS[0] in group:
        masks = {name: group[name][()] > 0 for name in MASKS}
    else:
        # Before version 0.2: a bound has no σ; what the data cannot tell has one, and no correlations.
        fitted = np.isfinite(vector) & ~np.isin(model.names, given)
        alone = np.isnan(np.diagonal(arrays["correlation"], axis1=1, axis2=2))
        masks = {"at_bound": fitted & np.isnan(sigma), "undetermined": fitted & ~np.isnan(sigma) & alone}
    return Estimate(vector=vector, sigma=sigma, **arrays, **masks, parts=_parts(group))


def _parts(group: h5py.Group) -> tuple[Part, ...]:
    """Read what makes the uncertainties; files before version 0.2 do not hold it."""
    if "uncertainty" not in group:
        return ()
    found = (group["uncertainty"][f"part_{k}"] for k in range(len(group["uncertainty"])))
    return tuple(
        Part(
            hdf5.read_text(one, "name"),
            hdf5.read_text(one, "words"),
            one["own"][()],
            one["modes"][()],
            bool(one["is_common"][()]),
        )
        for one in found
    )


def _key(name: str) -> str:
    """Name of a parameter in the file, where "wavelength" is the axis."""
    return "wavelength_of_model" if name == "wavelength" else name


def _names(group: h5py.Group, name: str) -> tuple[str, ...]:
    """Names that a file of an earlier version does not hold."""
    return tuple(text.decode() for text in group[name][()]) if name in group else ()


def _model_of(name: str, data: h5py.Group) -> Model:
    """Return the model of a file by its name.

    Raises
    ------
    InputError
        It is a page of one's own that is not found, or that has changed its parameters.
    """
    try:
        model = remade(name)
    except InputError as error:
        raise InputError(
            f"its model {name!r} cannot be made: {error}. If a page of yours is part of it, name its folder"
            " in the environment variable CLBRDF_MODELS"
        ) from error
    missing = [row for row in model.names if _key(row) not in data]
    if missing:
        raise InputError(
            f"its model {name!r} had other parameters when it was fitted: {missing[0]} is not in the file"
        )
    return model

"""A fit in an HDF5 file: the group `fit` of an entry, beside the scan."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.records import STATUSES, Estimate, Goodness, Search, Setup
from clbrdf.fit.through import Through
from clbrdf.fit.words import remarks_line
from clbrdf.instrument.place import LADDER
from clbrdf.instrument.settings import Instrument
from clbrdf.models import Model, remade
from clbrdf.scan import Scan
from clbrdf.storage import hdf5
from clbrdf.storage.tomlfile import parse_json

if TYPE_CHECKING:
    import h5py

    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]

ESTIMATE = ("correlation", "condition")
GOODNESS = ("objective", "relative_rms", "relative_rms_by_incident_angle")
SEARCH = ("evaluations", "starts", "agreeing", "acceptance", "not_finite")
SETUP = ("weights", "bounds")
"""Arrays of each record that go to the file under their own names."""

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
    if fit.through is not None:
        _write_through(fit.through, hdf5.group(group, "through", "NXcollection"))
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
        "through": _through(group["through"]) if "through" in group else None,
        "provenance": provenance,
    }


def _write_through(through: Through, group: h5py.Group) -> None:
    group["instrument"] = through.instrument.model_dump_json(exclude_none=True)
    group["source"] = through.source
    if through.angle is not None:
        hdf5.field(group, "angle", through.angle, "deg", "full angle of the aperture's cone")
    levels = hdf5.field(group, "levels", through.levels, "", "rules for nodes of beam and aperture")
    levels.attrs["names"] = [rule.name for rule in LADDER]


def _through(group: h5py.Group) -> Through:
    ours = [rule.name for rule in LADDER]
    names = [str(name) for name in group["levels"].attrs["names"]]
    unknown = [name for name in names if name not in ours]
    if unknown:
        raise InputError(f"its nodes were placed by {unknown[0]!r}, a rule that is not known; fit it again")
    places = np.array([ours.index(name) for name in names], dtype=np.uint8)
    return Through(
        instrument=parse_json(hdf5.read_text(group, "instrument"), Instrument, "fit/through/instrument"),
        source=hdf5.read_text(group, "source"),
        angle=group["angle"][()] if "angle" in group else None,
        levels=places[group["levels"][()]],
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
    return Estimate(vector=vector, sigma=sigma, **arrays, **masks)


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

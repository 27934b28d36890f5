"""A fit in an HDF5 file: the group `fit` of an entry, beside the scan."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, shortened
from clbrdf.fit.carried import Part
from clbrdf.fit.goodness import deviation_tests
from clbrdf.fit.montecarlo import MonteCarlo
from clbrdf.fit.records import STATUSES, Estimate, Goodness, Search, Setup
from clbrdf.fit.through import Through
from clbrdf.fit.words import remarks_line
from clbrdf.instrument.rules import CONES, LADDER
from clbrdf.models import Model, remade
from clbrdf.objective import WEIGHTS
from clbrdf.observation import ForwardModel
from clbrdf.scan import Scan
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, check_group, clean, read_items, read_texts, text_list_attribute

if TYPE_CHECKING:
    import h5py

    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]

ESTIMATE = ("correlation", "condition")
GOODNESS = (
    "objective",
    "relative_rms",
    "relative_rms_by_incident_angle",
    "degrees",
    "chi2_reduced",
    "scatter",
    "lag_one",
    "lag_score",
    "lack_of_fit",
    "repeats",
)
SEARCH = ("evaluations", "starts", "agreeing", "acceptance", "not_finite")
SETUP = ("weights", "bounds")
"""Arrays of each record that go to the file under their own names."""

MASKS = ("at_bound", "undetermined")
"""Of the estimate, (W, P) as 0 and 1; files before version 0.2 do not hold them."""

ENDS = ("lower", "upper")
"""Of the profile-likelihood intervals, beside each parameter where there are any."""

SCHEMA = (
    *(Item(name, ("W",)) for name in ("objective", "relative_rms")),
    Item("relative_rms_by_incident_angle", ("I", "W")),
    Item("status", ("W",), kind="bits"),
    Item("correlation", ("W", "P", "P")),
    Item("condition", ("W",)),
    *(Item(name, ("W",), kind="whole") for name in ("evaluations", "starts", "agreeing", "not_finite")),
    Item("acceptance", ("W",)),
    Item("weights", ("N", "W")),
    Item("bounds", ("P", "2")),
    *(Item(name, ("W", "P"), kind="truth", required=False) for name in MASKS),
    *(Item(name, ("W",), required=False) for name in GOODNESS[3:-1]),
    Item("repeats", ("W",), kind="whole", required=False),
)
"""Arrays of N directions × W wavelengths, I incident zeniths, P parameters."""

MONTE_CARLO = (
    Item("intervals", ("2", "2", "W", "P")),
    Item("median", ("W", "P")),
    Item("at_bound", ("W", "P")),
    Item("converged", ("W",)),
    Item("departs", ("W", "P"), kind="truth"),
)
DRAWN = (Item("draws", kind="whole"), Item("seed", kind="whole"))
PART = (Item("own", ("W", "P", "P")), Item("modes", ("M", "W", "P")))
COMMON = (Item("is_common", kind="truth"),)

SINGLE = (Item("smooth"), Item("rtol"), Item("left_out", kind="whole"))


def write(fit: Fit, group: h5py.Group) -> None:
    """Write all but the scan into an empty group."""
    setup, estimate = fit.setup, fit.estimate
    group["program"] = "clbrdf"
    group["method"], group["device"] = setup.method, fit.search.device
    group["model"] = fit.model.name
    group["given"], group["shared"] = list(fit.given), list(fit.shared)
    group["seed"] = setup.seed
    group["gls"] = np.uint8(setup.gls)
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
        if estimate.lower is not None and estimate.upper is not None:
            for name, ends in zip(ENDS, (estimate.lower, estimate.upper), strict=True):
                meaning = f"{name} end of the 68.3 % profile-likelihood interval of {row.name}"
                hdf5.field(data, f"{key}_{name}", ends[:, j], row.unit, meaning)
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
    parts = hdf5.group(group, "uncertainty", "NXcollection")
    for k, part in enumerate(estimate.parts):
        one = hdf5.group(parts, f"part_{k}", "NXcollection")
        one["name"], one["words"], one["is_common"] = part.name, part.words, np.uint8(part.is_common)
        hdf5.field(one, "own", part.own, "1", "covariance at each wavelength by itself")
        hdf5.field(one, "modes", part.modes, "1", "errors that wavelengths have in common")
    if fit.monte_carlo is not None:
        drawn = hdf5.group(group, "monte_carlo", "NXcollection")
        drawn["draws"], drawn["seed"] = fit.monte_carlo.draws, fit.monte_carlo.seed
        for item in MONTE_CARLO:
            value = getattr(fit.monte_carlo, item.name)
            truth = item.kind == "truth"
            hdf5.field(drawn, item.name, value.astype(np.uint8) if truth else value, "" if truth else "1")
    # For readers of the file: the program finds remarks anew from the numbers.
    group["remarks"] = [remarks_line(remarks) for remarks in fit.remarks]
    hdf5.write_mapping(group, "provenance", fit.provenance)


def read(entry: h5py.Group) -> dict[str, Any]:
    """Read what `write` wrote, or an earlier version did, as the arguments of a Fit.

    Raises
    ------
    InputError
        Arrays that do not belong together, or of another type or unit; a model that cannot be made.
    KeyError
        Something is missing.
    """
    scan = Scan.read(entry)
    group = entry["fit"]
    check_group(group)
    data = group["parameters"]
    check_group(data)
    model = _model_of(hdf5.read_text(group, "model"), data)
    n, w = scan.brdf.shape
    lengths = {"N": n, "W": w, "P": len(model.names), "I": len(scan.incident_angles)}
    arrays: dict[str, Any] = read_items(group, SCHEMA, lengths)
    rows = [
        Item(f"{_key(row.name)}{end}", ("W",), units.same_as(row.unit))
        for row in model.parameters
        for end in ("", "_errors")
    ]
    rows += [
        Item(f"{_key(row.name)}_{end}", ("W",), units.same_as(row.unit), required=False)
        for row in model.parameters
        for end in ENDS
    ]
    values = read_items(data, rows, lengths)
    vector = np.stack([values[_key(name)] for name in model.names], axis=1)
    sigma = np.stack([values[f"{_key(name)}_errors"] for name in model.names], axis=1)
    names, codes = text_list_attribute(group["status"], "names"), arrays["status"]
    unknown = sorted(set(names) - set(STATUSES))
    if unknown or codes.max() >= len(names):
        said = shortened(repr(unknown[0])) if unknown else codes.max()
        raise InputError(f"{clean(group.name)}/status holds {said}, which is no status; make the file again")
    given = _names(group, "given", model)
    provenance = hdf5.read_mapping(group, "provenance")
    setup = _setup(group, model, arrays, vector, given, provenance)
    estimate = _estimate(model, arrays, vector, sigma, given, _parts(group, lengths))
    return {
        "scan": scan,
        "model": model,
        "setup": setup,
        "estimate": _with_intervals(values, model, estimate),
        "goodness": _goodness(arrays, scan, model, setup, estimate),
        "search": Search(hdf5.read_text(group, "device"), *(arrays[name] for name in SEARCH)),
        "status": np.array([names[code] for code in codes]),
        "through": _through(group["through"], n) if "through" in group else None,
        "provenance": provenance,
        "monte_carlo": _monte_carlo(group, lengths),
    }


def _write_through(through: Through, group: h5py.Group) -> None:
    group["instrument"] = through.instrument.model_dump_json(exclude_none=True)
    group["source"] = through.source
    if through.angle is not None:
        hdf5.field(group, "angle", through.angle, "deg", "full angle of the aperture's cone")
    levels = hdf5.field(group, "levels", through.levels, "", "rules for nodes of beam and aperture")
    levels.attrs["names"] = [rule.name for rule in LADDER]


THROUGH = (
    Item("angle", ("N",), units.ANGLE, required=False),
    Item("levels", ("N", str(len(CONES))), kind="whole"),
)
"""Arrays of the instrument that a fit looked through."""


def _through(group: h5py.Group, directions: int) -> Through:
    arrays = read_items(group, THROUGH, {"N": directions})
    from clbrdf.instrument.settings import Instrument
    from clbrdf.storage.tomlfile import parse_json

    rules = {rule.name: place for place, rule in enumerate(LADDER)}
    names, levels = text_list_attribute(group["levels"], "names"), arrays["levels"]
    unknown = [name for name in names if name not in rules]
    if unknown or levels.min() < 0 or levels.max() >= len(names):
        said = shortened(repr(unknown[0])) if unknown else f"{levels.min()} to {levels.max()}"
        raise InputError(
            f"{clean(group.name)}/levels holds {said}, no rule that is known; fit the scan again"
        )
    places = np.array([rules[name] for name in names], dtype=np.uint8)
    through = Through(
        instrument=parse_json(
            hdf5.read_text(group, "instrument"), Instrument, f"{clean(group.name)}/instrument"
        ),
        source=hdf5.read_text(group, "source"),
        angle=arrays.get("angle"),
        levels=places[levels],
    )
    if through.angle is not None and not ((through.angle >= 0.0) & (through.angle < 180.0)).all():
        raise InputError(f"{clean(group.name)}/angle holds no angles of cones; fit the scan again")
    return through


def _monte_carlo(group: h5py.Group, lengths: Mapping[str, int]) -> MonteCarlo | None:
    if "monte_carlo" not in group:
        return None
    drawn = group["monte_carlo"]
    arrays: dict[str, Any] = read_items(drawn, MONTE_CARLO, lengths)
    counts = read_items(drawn, DRAWN)
    return MonteCarlo(int(counts["draws"]), int(counts["seed"]), **arrays)


def _setup(
    group: h5py.Group,
    model: Model,
    arrays: Mapping[str, Any],
    vector: Array,
    given: tuple[str, ...],
    provenance: dict[str, str],
) -> Setup:
    if "weighting" in group:
        single = read_items(group, SINGLE)
        numbers = {name: float(single[name]) for name in ("smooth", "rtol")}
        told: dict[str, Any] = {name: None if math.isnan(v) else v for name, v in numbers.items()}
        weighting, left_out = hdf5.read_text(group, "weighting"), int(single["left_out"])
    else:  # before version 0.2 only the provenance told it
        told = {
            name: _number(provenance[name]) if name in provenance else None for name in ("smooth", "rtol")
        }
        weighting = provenance.get("weights", "")
        left_out = int(_number(provenance.get("left_out", "0").split(" ")[0]))
    if not (arrays["weights"].min() >= 0.0 and arrays["weights"].max() < np.inf):
        raise InputError(f"{clean(group.name)}/weights holds what is no weight; fit the scan again")
    return Setup(
        weighting=weighting if weighting in WEIGHTS else "user",
        left_out=left_out,
        fixed={name: vector[:, model.names.index(name)].copy() for name in given},
        shared=_names(group, "shared", model),
        method=hdf5.read_text(group, "method"),
        seed=int(read_items(group, [Item("seed", kind="whole")])["seed"]),
        gls="gls" in group and bool(read_items(group, [Item("gls", kind="truth")])["gls"]),
        **told,
        **{name: arrays[name] for name in SETUP},
    )


def _number(text: str) -> float:
    """Return a number that the provenance tells; raise InputError where it is none."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"its provenance says {shortened(repr(text))}, which is no number") from None


def _estimate(
    model: Model,
    arrays: Mapping[str, Any],
    vector: Array,
    sigma: Array,
    given: tuple[str, ...],
    parts: tuple[Part, ...],
) -> Estimate:
    if MASKS[0] in arrays and MASKS[1] in arrays:
        masks = {name: arrays[name] for name in MASKS}
    else:
        # Before version 0.2: a bound has no σ; what the data cannot tell has one, and no correlations.
        fitted = np.isfinite(vector) & ~np.isin(model.names, given)
        alone = np.isnan(np.diagonal(arrays["correlation"], axis1=1, axis2=2))
        masks = {"at_bound": fitted & np.isnan(sigma), "undetermined": fitted & ~np.isnan(sigma) & alone}
    named = {name: arrays[name] for name in ESTIMATE}
    return Estimate(vector=vector, sigma=sigma, **named, **masks, parts=parts)


def _parts(group: h5py.Group, lengths: Mapping[str, int]) -> tuple[Part, ...]:
    """Read what makes the uncertainties; files before version 0.2 do not hold it."""
    if "uncertainty" not in group:
        return ()
    check_group(group["uncertainty"])
    found = (group["uncertainty"][f"part_{k}"] for k in range(len(group["uncertainty"])))
    return tuple(
        Part(
            hdf5.read_text(one, "name"),
            hdf5.read_text(one, "words"),
            **read_items(one, PART, lengths),
            is_common=bool(read_items(one, COMMON)["is_common"]),
        )
        for one in found
    )


def _with_intervals(values: Mapping[str, Array], model: Model, estimate: Estimate) -> Estimate:
    """Add the profile-likelihood intervals, where the file holds them."""
    names = [[f"{_key(name)}_{end}" for name in model.names] for end in ENDS]
    if not all(name in values for row in names for name in row):
        return estimate
    lower, upper = (np.stack([values[name] for name in row], axis=1) for row in names)
    return replace(estimate, lower=lower, upper=upper)


def _goodness(
    arrays: Mapping[str, Any], scan: Scan, model: Model, setup: Setup, estimate: Estimate
) -> Goodness:
    held = {name: arrays[name] for name in GOODNESS if name in arrays}
    if len(held) == len(GOODNESS):
        return Goodness(**held)
    # Before version 0.2 a file held some of them.
    seen = ForwardModel(model, model.features(scan.directions))

    def values_of(places: npt.NDArray[np.intp]) -> Array:
        return seen.brdf(estimate.vector[places][:, None, :])

    return Goodness(**deviation_tests(scan, setup, estimate.at_bound, held["objective"], values_of) | held)


def _key(name: str) -> str:
    """Name of a parameter in the file, where "wavelength" is the axis."""
    return "wavelength_of_model" if name == "wavelength" else name


def _names(group: h5py.Group, name: str, model: Model) -> tuple[str, ...]:
    """Return names of parameters, which a file of an earlier version does not hold."""
    found = read_texts(group, name) if name in group else ()
    for each in found:
        if each not in model.names:
            raise InputError(
                f"{clean(group.name)}/{name} names {shortened(repr(each))}, no parameter of its model"
            )
    return found


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

"""Which models are compared, and which of them a scan cannot decide on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import AngleGroups
from clbrdf.errors import InputError
from clbrdf.fit.given import given_parameters
from clbrdf.models import NEEDS_PHI, Model, Page, get_model
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

DEFAULT_CANDIDATES = (
    "lambert",
    "minnaert",
    "eon",
    "ggx+lambert",
    "ggx+minnaert",
    "beckmann+lambert",
    "ward+lambert",
    "abg+lambert",
    "kcorr+minnaert",
    "wang2013",
    "ggx+ggx+lambert",
    "ggx+ggx+minnaert",
    "abg+abg+lambert",
)
"""From a diffuser to a coating with two lobes. Soils and plants (ross_li, rpv, hapke) and clean mirrors
(rayleigh_rice, which needs n and k) are asked for by name: there they are what one wants to know about."""

ANISOTROPIC_CANDIDATES = ("ggx_anisotropic+lambert", "ward_anisotropic+lambert")
"""Added where the sample was turned, so that a scan can tell."""

ALL_DEFAULTS = "default"
"""In a list of models it stands for the candidates above."""

FEWEST_ANGLES = 3
"""Distinct incident zeniths: with two, leaving one out leaves nothing that depends on the incident zenith."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model that is compared.

    Attributes
    ----------
    model : Model
    fix : mapping of str to float or (W,) array
        Of the fixed parameters those that this model has.
    free : int
        Parameters fitted at each wavelength.
    """

    model: Model
    fix: Mapping[str, npt.ArrayLike]
    free: int


@dataclass(frozen=True)
class Skipped:
    """A model that was not compared, and why."""

    model: str
    reason: str


def default_candidates(scan: Scan) -> tuple[str, ...]:
    """Names of the models that are compared where none are named."""
    turned = len(scan.rotations()) > 0
    return DEFAULT_CANDIDATES + (ANISOTROPIC_CANDIDATES if turned else ())


def resolve(
    scan: Scan, models: Sequence[str | Model | Page] | None, fix: Mapping[str, npt.ArrayLike], force: bool
) -> list[Model]:
    """Return the models that are asked for, each once.

    Raises
    ------
    InputError
        An empty list, an unknown model, a sum of whole surfaces without `force`, or a fixed parameter that
        none of them has.
    """
    if isinstance(models, str):
        models = [name for name in models.split(",") if name.strip()]
    asked: list[str | Model | Page] = []
    for entry in [ALL_DEFAULTS] if models is None else models:
        is_all = isinstance(entry, str) and entry.strip() == ALL_DEFAULTS
        asked += default_candidates(scan) if is_all else [entry]
    if not asked:
        raise InputError(f"no models to compare; name some, as in ggx+lambert,eon, or {ALL_DEFAULTS}")
    found: dict[str, Model] = {}
    for entry in asked:
        model = get_model(entry, force=force)
        found.setdefault(model.name, model)
    for name in fix:
        if not any(fixed_of(model, {name: 0.0}) for model in found.values()):
            raise InputError(f"none of the models has a parameter {name!r} to fix: {', '.join(found)}")
    return list(found.values())


def fixed_of(model: Model, fix: Mapping[str, npt.ArrayLike]) -> dict[str, npt.ArrayLike]:
    """Return what is fixed of a model, by its full names: "n" stands for "ggx_conductor.n", too."""
    return {own: fix[name] for own in model.names for name in (own, own.split(".")[-1]) if name in fix}


def thin_wavelengths(
    scan: Scan,
    models: Sequence[Model],
    fix: Mapping[str, npt.ArrayLike],
    used: npt.NDArray[np.bool_],
    groups: AngleGroups,
) -> npt.NDArray[np.bool_]:
    """Return where a wavelength has values, but too few for one of the models without some angle, (W,).

    A ranking leaves them out, so that one wavelength that was hardly measured does not shut out models; none
    is thin where all are.
    """
    free = [_free(scan, model, fix) for model in models]
    left = [used.sum(axis=0) - used[groups.group == k].sum(axis=0) for k in range(len(groups.theta_i))]
    thin = used.any(axis=0) & (np.min(left, axis=0) <= max(free))
    return thin if (used.any(axis=0) & ~thin).any() else np.zeros_like(thin)


def _free(scan: Scan, model: Model, fix: Mapping[str, npt.ArrayLike]) -> int:
    """Count the parameters that are fitted; 0 for a model that cannot be fitted."""
    try:
        return len(model.parameters) - len(given_parameters(scan, model, fixed_of(model, fix)))
    except InputError:
        return 0


def sift(
    scan: Scan,
    models: Sequence[Model],
    fix: Mapping[str, npt.ArrayLike],
    used: npt.NDArray[np.bool_],
    groups: AngleGroups,
) -> tuple[list[Candidate], list[Skipped]]:
    """Part the models into those that a scan can compare, and those that it cannot.

    Parameters
    ----------
    scan : Scan
        N directions × W wavelengths.
    models : sequence of Model
    fix : mapping
    used : (N, W) bool
        Values that are fitted.
    groups : AngleGroups

    Raises
    ------
    InputError
        Too few incident angles to leave one out, or no model is left.
    """
    seen = [k for k in range(len(groups.theta_i)) if used[groups.group == k].any()]
    if len(seen) < FEWEST_ANGLES:
        raise InputError(
            f"{len(seen)} incident angle{'s' if len(seen) != 1 else ''} with usable values: the choice leaves"
            f" out one at a time and needs {FEWEST_ANGLES} or more; fit one model with 'clbrdf fit'"
        )
    taken, skipped = [], []
    for model in models:
        own = fixed_of(model, fix)
        try:
            given = given_parameters(scan, model, own)
        except InputError as error:
            skipped.append(Skipped(model.name, str(error)))
            continue
        free = len(model.parameters) - len(given)
        reason = _too_few(model, free, scan, used, groups)
        if reason:
            skipped.append(Skipped(model.name, reason))
        else:
            taken.append(Candidate(model, own, free))
    if not taken:
        told = "; ".join(f"{entry.model}: {entry.reason}" for entry in skipped)
        raise InputError(f"no model is left to compare ({told})")
    return taken, skipped


def _too_few(model: Model, free: int, scan: Scan, used: npt.NDArray[np.bool_], groups: AngleGroups) -> str:
    """Say why a scan cannot decide on a model, "" where it can."""
    if model.flags & NEEDS_PHI and len(scan.rotations()) == 0:
        return "it depends on the sample's own azimuth, and the sample was not turned"
    total = used.sum(axis=0)
    for k, angle in enumerate(groups.theta_i):
        left = total - used[groups.group == k].sum(axis=0)
        # A wavelength that was never measured is fitted by nobody.
        few = np.flatnonzero((total > 0) & (left <= free))
        if len(few):
            return (
                f"{left[few[0]]} values at {scan.labels[few[0]]} without θi = {angle:g}°,"
                f" and {free} parameters need more than {free}"
            )
    return ""

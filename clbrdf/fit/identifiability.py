"""What a scan cannot tell about a model, in plain words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from clbrdf.models import Model
from clbrdf.observation import ForwardModel
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

NO_LOBE = 1e-6
"""Share of the BRDF below which the specular part counts as none."""

SEPARATOR = "; "

STRONG = 0.999
"""Correlation from which two parameters are named as tied together."""


def remarks(
    seen: ForwardModel,
    scan: Scan,
    parameters: Array,
    undetermined: npt.NDArray[np.bool_],
    at_bound: npt.NDArray[np.bool_],
    correlation: Array,
    used: npt.NDArray[np.bool_],
    fitted_count: int,
) -> tuple[str, ...]:
    """Return for each of W wavelengths what the data leave open there; "" where nothing.

    Parameters
    ----------
    seen : ForwardModel
        Of the scan's directions.
    scan : Scan
        What was fitted, W wavelengths.
    parameters : (W, P) float64
        NaN where there is no fit.
    undetermined, at_bound : (W, P) bool
    correlation : (W, P, P) float64
    used : (N, W) bool
        Values that were fitted.
    fitted_count : int
        Parameters that were fitted.
    """
    model = seen.model

    def words(k: int) -> list[str]:
        theta_i = scan.theta_i[used[:, k]]
        if _no_lobe(seen, used[:, k], parameters[k]):
            lobe = _lobe_names(model)
            kept = np.array([name not in lobe for name in model.names])
            open_words = [f"{_listed(lobe)} open: no specular part in the data"]
            return [*open_words, *_held(model, parameters[k], at_bound[k] & kept)]
        return [
            *_open(model, theta_i, undetermined[k], fitted_count),
            *_held(model, parameters[k], at_bound[k]),
            *_tied(model, correlation[k]),
        ]

    return tuple(SEPARATOR.join(words(k)) for k in range(len(parameters)))


def by_remark(remarks: Sequence[str], wavelength: Array) -> list[tuple[str, Array]]:
    """Return each remark once with the wavelengths (nm) where it holds, the most frequent first."""
    places: dict[str, list[float]] = {}
    for texts, nm in zip(remarks, wavelength, strict=True):
        for text in texts.split(SEPARATOR) if texts else []:
            # The digits of a correlation differ everywhere; what is tied does not.
            places.setdefault(text.split(" (correlation")[0], []).append(float(nm))
    ordered = sorted(places.items(), key=lambda item: -len(item[1]))
    return [(text, np.array(values)) for text, values in ordered]


def _lobe_names(model: Model) -> list[str]:
    assert model.structure is not None
    return [*model.structure.growth, *model.structure.shape, model.structure.linear[0]]


def _no_lobe(seen: ForwardModel, used: npt.NDArray[np.bool_], parameters: Array) -> bool:
    """Whether a model that tells its lobe from the rest has none in some directions."""
    model, structure = seen.model, seen.model.structure
    if structure is None or used.sum() < len(model.names) or not np.isfinite(parameters).all():
        return False
    rest = parameters[model.places(structure.linear)[1]] * structure.diffuse
    fitted = seen.take(used).brdf(parameters[None, :])
    return bool((fitted - rest).max() <= NO_LOBE * fitted.max())


def _open(model: Model, theta_i: Array, undetermined: npt.NDArray[np.bool_], fitted_count: int) -> list[str]:
    """Which parameters the data cannot tell, and the reason where the model's structure gives one."""
    names = [name for name, unknown in zip(model.names, undetermined, strict=True) if unknown]
    if not names:
        return []
    values = len(theta_i)
    if values < fitted_count:
        plural = "s" if values > 1 else ""
        return [f"{_listed(names)} open: {values} value{plural} for {fitted_count} parameters"]
    structure = model.structure
    if structure is not None:
        amplitude = {*structure.growth, structure.linear[0]}
        seen = len(np.unique(theta_i))
        if set(names) <= amplitude and seen < len(amplitude):
            angles = f"{seen} incident angle{'s' if seen > 1 else ''}"
            return [f"{_listed(names)} open: {angles}, {len(amplitude)} are needed"]
    return [f"{_listed(names)} open: the data cannot tell them apart"]


def _held(model: Model, parameters: Array, at_bound: npt.NDArray[np.bool_]) -> list[str]:
    return [
        f"{name} at its bound {value:g}"
        for name, value, bound in zip(model.names, parameters, at_bound, strict=True)
        if bound
    ]


def _tied(model: Model, correlation: Array) -> list[str]:
    """Pairs of parameters that the data hardly tell apart."""
    rows, columns = np.nonzero(np.triu(np.abs(np.nan_to_num(correlation)) > STRONG, k=1))
    return [
        f"{model.names[i]} and {model.names[j]} tied (correlation {correlation[i, j]:.4f})"
        for i, j in zip(rows, columns, strict=True)
    ]


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"

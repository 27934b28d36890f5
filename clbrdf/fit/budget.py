"""Tables of what makes the error bars of a fit: by component, by halves, and of means over wavelengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]

NO_EFFECT = 1e-9
"""Share of an error bar below which a component is what rounding leaves of one that does not act."""


@dataclass(frozen=True)
class MeanRow:
    """The mean of a parameter over wavelengths: value, 1σ, and both halves of it, in the parameter's unit."""

    parameter: str
    value: float
    sigma: float
    random: float
    common: float
    count: int


def fitted_names(fit: Fit) -> list[str]:
    """Return the parameters that were fitted."""
    return [name for name in fit.model.names if name not in fit.given]


def has_halves(fit: Fit) -> bool:
    """Whether some errors are random over directions and others are common to several."""
    return len({part.is_common for part in fit.estimate.parts}) == 2


def half_sigma(fit: Fit, is_common: bool) -> Array:
    """Return 1σ (W, P) of the common or of the random half; NaN where a parameter has no σ."""
    out = np.zeros(fit.estimate.vector.shape)
    for part in fit.estimate.parts:
        if part.is_common == is_common:
            out += np.diagonal(part.covariance, axis1=1, axis2=2)
    return np.where(np.isfinite(fit.estimate.sigma), np.sqrt(np.maximum(out, 0.0)), np.nan)


def budget_table(fit: Fit) -> list[tuple[str, list[float]]]:
    """Return a row for each component, both halves and all: medians over wavelengths of 1σ by parameter.

    NaN where a parameter has an error bar at no wavelength.
    """
    names = fitted_names(fit)
    places = [fit.model.names.index(name) for name in names]
    budgets = {name: fit.budget(name) for name in names}
    rows = [
        (part.name, np.stack([budgets[name][part.name] for name in names], axis=1))
        for part in fit.estimate.parts
    ]
    if has_halves(fit):
        rows += [
            (title, half_sigma(fit, common)[:, places])
            for title, common in (("random part", False), ("common part", True))
        ]
    rows.append(("all", fit.estimate.sigma[:, places]))
    return [
        (title, [_median(fit, name, values[:, j]) for j, name in enumerate(names)]) for title, values in rows
    ]


def _median(fit: Fit, name: str, values: Array) -> float:
    good = np.isfinite(fit.sigma[name])
    if not good.any():
        return float("nan")
    size = float(np.median(values[good]))
    return 0.0 if size < NO_EFFECT * np.median(fit.sigma[name][good]) else size


def mean_table(fit: Fit) -> list[MeanRow]:
    """Return the means over wavelengths of all fitted parameters; none of bands or one wavelength."""
    if len(fit.wavelength) < 2 or fit.scan.bands:
        return []
    is_common = {part.name: part.is_common for part in fit.estimate.parts}
    rows = []
    for name in fitted_names(fit):
        mean = fit.mean(name)
        random, common = (
            float(np.sqrt(sum(s**2 for one, s in mean.parts.items() if is_common[one] == wanted)))
            for wanted in (False, True)
        )
        rows.append(MeanRow(name, mean.value, mean.sigma, random, common, mean.count))
    return rows

"""Whether a fitted model is reciprocal, and whether it reflects more than it receives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.fit.result import Fit
from clbrdf.geometry import Directions

MOST_WAVELENGTHS = 8
MOST_ANGLES = 4
"""Of those fitted, spread over all of them: these are figures for a table."""


@dataclass(frozen=True)
class Behaviour:
    """Attributes are those of `clbrdf.choose.result.Ranked`."""

    exchange: float
    reflectance: float
    cut: float


def behaviour(fit: Fit) -> Behaviour:
    """Return figures of a fit; NaN where no wavelength has parameters."""
    # Here, so that `import clbrdf` does not load scenes and pydantic with them.
    from clbrdf.scene.checks import reflectance_of, worst_exchange

    good = np.flatnonzero(np.isfinite(fit.vector).all(axis=1))
    if not len(good):
        return Behaviour(float("nan"), float("nan"), float("nan"))
    shown = _spread(good, MOST_WAVELENGTHS)
    parameters = fit.vector[shown][:, None, :]

    def brdf(directions: Directions) -> np.ndarray:
        return fit.model.brdf(parameters, fit.model.features(directions)).T

    angles = _spread(fit.scan.incident_angles, MOST_ANGLES)
    energy = reflectance_of(brdf, angles, fit.model.diverges(parameters))
    exchange = worst_exchange(brdf, fit.wavelength[shown])
    return Behaviour(exchange.factor, float(energy.values.max()), energy.max_zenith)


def _spread(values: np.ndarray, most: int) -> np.ndarray:
    """Return at most so many of the values, the first and the last among them."""
    return values[np.unique(np.linspace(0, len(values) - 1, most).round().astype(np.intp))]

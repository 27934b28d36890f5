"""Energy and reciprocity of a fit, as a page shows them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.result import Fit
from clbrdf.geometry import Directions
from clbrdf.scene.checks import (
    Exchange,
    Reflectance,
    cut_words,
    energy_words,
    reciprocity_words,
    reflectance_of,
    worst_exchange,
)

Array = npt.NDArray[np.float64]

MOST_WAVELENGTHS, MOST_ANGLES = 25, 8
"""Spread over all: enough for a curve, and quick."""

NOTABLE_EXCHANGE = 1.05
"""Factor between exchanged directions from which it is a warning."""


@dataclass(frozen=True, eq=False)
class Promises:
    """Directional-hemispherical reflectance at some wavelengths (nm), and the worst exchange."""

    wavelength: Array
    labels: tuple[str, ...]
    reflectance: Reflectance
    exchange: Exchange

    def record(self) -> dict[str, Any]:
        """Return it as a mapping that JSON takes."""
        return {
            "nm": [None if np.isnan(w) else float(w) for w in self.wavelength],
            "labels": list(self.labels),
            "theta_i": self.reflectance.theta_i.tolist(),
            "rho": [[_finite(v) for v in row] for row in self.reflectance.values],
            "words": [
                energy_words(self.reflectance, self.wavelength),
                cut_words(self.reflectance),
                reciprocity_words(self.exchange),
            ],
        }

    def warnings(self) -> list[str]:
        """Return what breaks a law of physics."""
        lines = []
        if np.nanmax(self.reflectance.values, initial=0.0) > 1.0 + 1e-9:
            lines.append(f"the model {energy_words(self.reflectance, self.wavelength)}")
        if self.exchange.factor > NOTABLE_EXCHANGE:
            lines.append(f"the model is {reciprocity_words(self.exchange)}")
        return lines


def promises_of(fit: Fit | None) -> Promises | None:
    """Return energy and reciprocity of a fit; None where nothing is fitted."""
    if fit is None:
        return None
    good = np.flatnonzero(np.isfinite(fit.vector).all(axis=1))
    if not good.size:
        return None
    shown = good[_spread(len(good), MOST_WAVELENGTHS)]
    angles = fit.scan.incident_angles
    angles = angles[_spread(len(angles), MOST_ANGLES)]
    parameters = fit.vector[shown][:, None, :]

    def brdf(directions: Directions) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):
            return fit.model.brdf(parameters, fit.model.features(directions)).T

    with np.errstate(over="ignore", invalid="ignore"):
        reflectance = reflectance_of(brdf, angles, fit.model.diverges(parameters))
        exchange = worst_exchange(brdf, fit.wavelength[shown])
    labels = tuple(fit.scan.labels[k] for k in shown)
    return Promises(fit.wavelength[shown], labels, reflectance, exchange)


def _spread(count: int, most: int) -> npt.NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

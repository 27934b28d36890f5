"""A scan of GGX + Lambert with noise, in the plane of incidence."""

from __future__ import annotations

import numpy as np

from clbrdf import Scan
from clbrdf.geometry import Directions
from clbrdf.models import get_model

SIGNED = np.arange(-75.0, 75.1, 5.0)
INCIDENT = (15.0, 35.0, 55.0, 70.0)
MODELS = ("lambert", "ggx+lambert", "beckmann+lambert")


def made(noise: float = 0.01, wavelengths=(500.0, 600.0), factor=None) -> Scan:
    """GGX + Lambert in the plane of incidence; `factor` (N,) is an error that no model has."""
    theta_i, signed = np.repeat(INCIDENT, len(SIGNED)), np.tile(SIGNED, len(INCIDENT))
    phi = np.where(signed < 0.0, 0.0, 180.0)
    model = get_model("ggx+lambert")
    vector = model.vector({"ggx.alpha": 0.2, "ggx.F0": 0.05, "ggx.F90": 1.0, "lambert.rho": 0.1})
    directions = Directions.relative(theta_i, np.abs(signed), phi)
    exact = model.brdf(vector[None, :], model.features(directions))[:, None] * np.ones(len(wavelengths))
    measured = exact * (1.0 + noise * np.random.default_rng(7).standard_normal(exact.shape))
    if factor is not None:
        measured *= factor(theta_i, signed)[:, None]
    return Scan(
        theta_i, 0.0, np.abs(signed), phi, wavelengths, measured, sigma=noise * measured, sample="made"
    )

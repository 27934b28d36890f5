"""Fits with parts exchanged, to plant what a test looks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from clbrdf import Fit


def with_parameters(fit: Fit, parameters: Mapping[str, Any], sigma: Mapping[str, Any] | None = None) -> Fit:
    """Return a fit whose parameters, and σ, are others; goodness and status stay what they were."""
    names = fit.model.names
    vector = np.stack([np.asarray(parameters[name], float) for name in names], axis=1)
    deviation = fit.estimate.sigma if sigma is None else np.stack([sigma[name] for name in names], axis=1)
    return replace(fit, estimate=replace(fit.estimate, vector=vector, sigma=np.array(deviation, float)))


def with_part(fit: Fit, part: str, **values: Any) -> Fit:
    """Return a fit with fields of one of its records exchanged: "setup", "goodness", "search", …"""
    return replace(fit, **{part: replace(getattr(fit, part), **values)})

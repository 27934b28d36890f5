"""wang2013 by hand: one exponential of a sum of base-2 logarithms, and what a fit can solve without search.

The specular term neither overflows nor underflows where only its factors do, log2 of geometry and of ks add
up before the one exponential, and the exponent can be carried in pairs of numbers (`derived`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, attenuation_times_cosines, one_minus_cos_gamma, trigonometry
from clbrdf.models.model import LOG2_OF_ZERO
from clbrdf.models.tuned.wang2013_structure import STRUCTURE

Array = npt.NDArray[np.float64]

LOG2_E = 1.4426950408889634
LN_2 = 0.6931471805599453


def log2_or_zero(values: Array) -> Array:
    """log2 of values ≥ 0 with LOG2_OF_ZERO for 0."""
    out = np.full_like(values, LOG2_OF_ZERO)
    return np.log2(values, out=out, where=values > 0.0)


def features(directions: Directions, dtype: type[np.floating] = np.float64) -> Array:
    """(N, 3): cosθi, log2(1 − cosγ), log2(G / (π cosθi cosθr)), computed in a type.

    G / (cosθi cosθr) = (G cosθi cosθr) / (cosθi cosθr)², with the product in the numerator from its
    stable form; the square is formed as a difference of logarithms, for the range of fp32.
    """
    t = trigonometry(directions, dtype)
    log2_v = log2_or_zero(one_minus_cos_gamma(t))
    log2_s = log2_or_zero(attenuation_times_cosines(t))
    log2_s -= 2.0 * np.log2(t.cos_i * t.cos_r) + np.log2(np.pi)
    return np.stack([t.cos_i, log2_v, log2_s], axis=-1)


def _specular(parameters: Array, x: Array) -> tuple[Array, Array, Array]:
    """Return specular term over k_s, the power v^d, and b − cosθi, each (..., N)."""
    a, b, c, d = (parameters[..., j] for j in range(4))
    power = np.exp2(d * x[:, 1])
    away = b - x[:, 0]
    return np.exp2(LOG2_E * (c * power + a * away**2) + x[:, 2]), power, away


def brdf(parameters: Array, x: Array) -> Array:
    """f_r, (..., N) in 1/sr, of parameters (..., 1, 6) and features (N, 3)."""
    a, b, c, d, k_s, k_d = (parameters[..., j] for j in range(6))
    exponent = LOG2_E * (c * np.exp2(d * x[:, 1]) + a * (b - x[:, 0]) ** 2) + x[:, 2] + log2_or_zero(k_s)
    return np.exp2(exponent) + k_d / np.pi


def jacobian(parameters: Array, x: Array) -> Array:
    """∂f_r/∂(a, b, c, d, k_s, k_d), (..., N, 6), of parameters (..., 1, 6) and features (N, 3)."""
    a, _, c, _, k_s, _ = (parameters[..., j] for j in range(6))
    per_k_s, power, away = _specular(parameters, x)
    lobe = k_s * per_k_s
    columns = [
        lobe * away**2,
        lobe * 2.0 * a * away,
        lobe * power,
        lobe * c * power * x[:, 1] * LN_2,
        per_k_s,
        np.full_like(lobe, 1.0 / np.pi),
    ]
    return np.stack(columns, axis=-1)


def derived(parameters: Array) -> Array:
    """Return a log2 e, b, c log2 e, d, log2 ks, kd / π of parameters (..., 6)."""
    a, b, c, d, k_s, k_d = (parameters[..., j] for j in range(6))
    return np.stack([LOG2_E * a, b, LOG2_E * c, d, log2_or_zero(k_s), k_d / np.pi], axis=-1)


TUNED = {
    "feature_names": ("cos_i", "log2_v", "log2_s"),
    "incident_features": 1,
    "features": features,
    "brdf": brdf,
    "jacobian": jacobian,
    "derived": derived,
    "structure": STRUCTURE,
}

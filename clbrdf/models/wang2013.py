"""The six-parameter spectral BRDF model of Wang, Zhang and Dong (2013).

    f_r = k_s D G F / (π cosθi cosθr) + k_d / π                        (8)
    D   = exp[c (1 − cosγ)^d]             peak around the mirror direction     (9)
    G   = √(tan²θi + tan²θr − 2 tanθi tanθr cosφ)                             (11)
    F   = exp[a (b − cosθi)²]             growth with the incident angle      (12)

with γ from (10). G is 0 in the retro direction and grows without bound towards grazing; F depends on
θi alone, so the model is not reciprocal, and the parameters of Table 1 do not conserve energy.

The specular term is formed as one exponential of a sum of logarithms: it neither overflows nor
underflows where only its factors do.

Source: H. Wang, W. Zhang, A. Dong, Measurement 46 (2013) 3654–3661,
equations (8)–(12).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, attenuation_times_cosines, one_minus_cos_gamma, trigonometry
from clbrdf.models.model import LOG2_OF_ZERO, Model, Parameter, Term
from clbrdf.models.wang2013_structure import STRUCTURE

if TYPE_CHECKING:
    import mpmath

Array = npt.NDArray[np.float64]

LOG2_E = 1.4426950408889634
LN_2 = 0.6931471805599453


def log2_or_zero(values: Array) -> Array:
    """log2 of values ≥ 0 with LOG2_OF_ZERO for 0."""
    out = np.full_like(values, LOG2_OF_ZERO)
    return np.log2(values, out=out, where=values > 0.0)


def features(
    directions: Directions,
    dtype: type[np.floating] = np.float64,
    left_out: frozenset[str] = frozenset(),
) -> Array:
    """(N, 3): cosθi, log2(1 − cosγ), log2(G / (π cosθi cosθr)), computed in a type.

    Without the Fresnel factor the first is missing, without the specular lobe all three, without the
    attenuation factor G is 1.

    G / (cosθi cosθr) = (G cosθi cosθr) / (cosθi cosθr)², with the product in the numerator from its
    stable form; the square is formed as a difference of logarithms, for the range of fp32.
    """
    if "specular" in left_out:
        return np.empty((len(directions), 0), dtype)
    t = trigonometry(directions, dtype)
    log2_v = log2_or_zero(one_minus_cos_gamma(t))
    if "attenuation" in left_out:
        log2_s = -(np.log2(t.cos_i * t.cos_r) + np.log2(np.pi))
    else:
        log2_s = log2_or_zero(attenuation_times_cosines(t))
        log2_s -= 2.0 * np.log2(t.cos_i * t.cos_r) + np.log2(np.pi)
    columns = [log2_v, log2_s] if "fresnel" in left_out else [t.cos_i, log2_v, log2_s]
    return np.stack(columns, axis=-1)


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


def reference(
    parameters: Array, theta_i: float, theta_r: float, phi: float, left_out: frozenset[str] = frozenset()
) -> mpmath.mpf:
    """f_r as equations (8)-(12) print it, 1/sr, in the working precision of mpmath.

    1 − cosγ loses as many digits as it is small: give mpmath 20 digits more than wanted.
    """
    from mpmath import cos, exp, mpf, pi, radians, sin, sqrt, tan

    a, b, c, d, k_s, k_d = (mpf(float(value)) for value in parameters)
    i, r, p = (radians(mpf(float(angle))) for angle in (theta_i, theta_r, phi))
    cos_gamma = sqrt((cos(i) * cos(r) - sin(i) * sin(r) * cos(p) + 1) / 2)
    D = exp(c * abs(1 - cos_gamma) ** d)
    G = sqrt(abs(tan(i) ** 2 + tan(r) ** 2 - 2 * tan(i) * tan(r) * cos(p)))
    if "attenuation" in left_out:
        G = mpf(1)
    F = exp(a * (b - cos(i)) ** 2)
    return k_s * D * G * F / (pi * cos(i) * cos(r)) + k_d / pi


MODEL = Model(
    name="wang2013",
    title="Wang, Zhang and Dong 2013, six parameters",
    source="Measurement 46 (2013) 3654-3661",
    parameters=(
        Parameter("a", "1", 3.87, (-20.0, 20.0), "strength of the Fresnel factor F (12)"),
        Parameter("b", "1", 0.5216, (-1.0, 2.0), "cosine of the incident angle where F is 1 (12)"),
        Parameter("c", "1", -300.0, (-1e6, 0.0), "steepness of the lobe D (9)", scale="log", log_floor=1e-9),
        Parameter("d", "1", 0.74, (0.2, 2.0), "shape of the lobe D (9)"),
        Parameter("ks", "1", 451.7958, (0.0, 1e5), "weight of the specular lobe (8)", "log", 1e-12),
        Parameter("kd", "1", 1.3034, (0.0, 10.0), "weight of the diffuse term (8)", "log", 1e-12),
    ),
    feature_names=("cos_i", "log2_v", "log2_s"),
    incident_features=1,
    features=features,
    brdf=brdf,
    jacobian=jacobian,
    derived=derived,
    reference=reference,
    structure=STRUCTURE,
    grazing="ks",
    terms=(
        Term(
            "specular",
            "the lobe k_s D G F / (π cosθi cosθr) of (8)",
            (("c", 0.0), ("d", 1.0), ("ks", 0.0)),
            ("log2_v", "log2_s"),
        ),
        Term("fresnel", "the factor F of (12)", (("a", 0.0), ("b", 0.0)), ("cos_i",), "specular"),
        Term("attenuation", "the factor G of (11)", (), (), "specular"),
        Term("diffuse", "the summand k_d / π of (8)", (("kd", 0.0),)),
    ),
)

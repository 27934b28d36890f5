"""Equations (8)-(12) in 60-digit arithmetic, written as the paper prints them."""

from __future__ import annotations

from collections.abc import Sequence

from mpmath import cos, exp, fabs, mp, mpf, pi, radians, sin, sqrt, tan

mp.dps = 60


def cos_gamma(theta_i: float, theta_r: float, phi: float) -> mpf:
    """Equation (10)."""
    i, r, p = (radians(mpf(angle)) for angle in (theta_i, theta_r, phi))
    return sqrt((cos(i) * cos(r) - sin(i) * sin(r) * cos(p) + 1) / 2)


def attenuation(theta_i: float, theta_r: float, phi: float) -> mpf:
    """Equation (11)."""
    i, r, p = (radians(mpf(angle)) for angle in (theta_i, theta_r, phi))
    # The sum of squares is never negative; rounding in the 60th digit can make it so.
    return sqrt(fabs(tan(i) ** 2 + tan(r) ** 2 - 2 * tan(i) * tan(r) * cos(p)))


def brdf(parameters: Sequence[float], theta_i: float, theta_r: float, phi: float) -> mpf:
    """Equation (8), 1/sr."""
    a, b, c, d, ks, kd = (mpf(value) for value in parameters)
    cos_i, cos_r = cos(radians(mpf(theta_i))), cos(radians(mpf(theta_r)))
    D = exp(c * fabs(1 - cos_gamma(theta_i, theta_r, phi)) ** d)
    F = exp(a * (b - cos_i) ** 2)
    G = attenuation(theta_i, theta_r, phi)
    return ks * D * G * F / (pi * cos_i * cos_r) + kd / pi

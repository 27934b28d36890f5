"""Reflectance of a smooth boundary for unpolarised light, by Snell's law with a complex index."""

from __future__ import annotations

from mpmath import mpc, mpf, sqrt


def schlick(cosine: mpf, F0: mpf, F90: mpf) -> mpf:
    return F0 + (F90 - F0) * (1 - cosine) ** 5


def polarised(cosine: mpf, n: mpf, k: mpf) -> tuple[mpf, mpf]:
    """Give the reflectances for s and p light."""
    index = mpc(n, k)
    sine_inside = sqrt(1 - cosine**2) / index
    cosine_inside = sqrt(1 - sine_inside**2)
    r_s = (cosine - index * cosine_inside) / (cosine + index * cosine_inside)
    r_p = (index * cosine - cosine_inside) / (index * cosine + cosine_inside)
    return abs(r_s) ** 2, abs(r_p) ** 2


def unpolarised(cosine: mpf, n: mpf, k: mpf) -> mpf:
    s, p = polarised(cosine, n, k)
    return (s + p) / 2

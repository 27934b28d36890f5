"""Facets with Gaussian slopes, with three Fresnel factors; sources in microfacet.py."""

from __future__ import annotations

from mpmath import erf, exp, mpf, pi, sqrt

from tests.reference.models.geometry import Vector
from tests.reference.models.microfacet import (
    conductor,
    dielectric,
    microfacet,
    roughness_squared,
    schlick,
    slope_squared,
)


def distribution(h: Vector, alpha_x: mpf, alpha_y: mpf) -> mpf:
    return exp(-slope_squared(h, alpha_x, alpha_y)) / (pi * alpha_x * alpha_y * h[2] ** 4)


def smith(v: Vector, alpha_x: mpf, alpha_y: mpf) -> mpf:
    """Give Λ; along the normal nothing is shadowed."""
    roughness = sqrt(roughness_squared(v, alpha_x, alpha_y))
    if not roughness:
        return mpf(0)
    a = 1 / roughness
    return (erf(a) - 1) / 2 + exp(-(a**2)) / (2 * a * sqrt(pi))


BECKMANN = microfacet("alpha F0 F90", distribution, smith, schlick)
BECKMANN_DIELECTRIC = microfacet("alpha n scale", distribution, smith, dielectric)
BECKMANN_CONDUCTOR = microfacet("alpha n k scale", distribution, smith, conductor)

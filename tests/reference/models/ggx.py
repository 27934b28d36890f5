"""Facets after Trowbridge and Reitz (GGX), with four Fresnel factors; sources in microfacet.py."""

from __future__ import annotations

from mpmath import mpf, pi, sqrt

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
    return 1 / (pi * alpha_x * alpha_y * h[2] ** 4 * (1 + slope_squared(h, alpha_x, alpha_y)) ** 2)


def smith(v: Vector, alpha_x: mpf, alpha_y: mpf) -> mpf:
    """Give Λ."""
    return (sqrt(1 + roughness_squared(v, alpha_x, alpha_y)) - 1) / 2


GGX = microfacet("alpha F0 F90", distribution, smith, schlick)
GGX_DIELECTRIC = microfacet("alpha n scale", distribution, smith, dielectric)
GGX_CONDUCTOR = microfacet("alpha n k scale", distribution, smith, conductor)
GGX_ANISOTROPIC = microfacet("alpha_x alpha_y F0 F90", distribution, smith, schlick)

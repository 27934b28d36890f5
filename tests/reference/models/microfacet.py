"""Cook and Torrance's form with Smith's height-correlated shadowing: F D G2 / (4 cosθi cosθr).

doi:10.1145/357290.357293, Walter et al., EGSR 2007, and Heitz, JCGT 3(2) (2014), also for two roughnesses.
"""

from __future__ import annotations

from collections.abc import Callable

from mpmath import mpf

from tests.reference.models import fresnel
from tests.reference.models.geometry import Vector
from tests.reference.models.reference import Reference

OfDirection = Callable[[Vector, mpf, mpf], mpf]


def roughness_squared(v: Vector, alpha_x: mpf, alpha_y: mpf) -> mpf:
    """Give (α tanθ)² of a direction, with α the roughness along its azimuth."""
    return ((alpha_x * v[0]) ** 2 + (alpha_y * v[1]) ** 2) / v[2] ** 2


def slope_squared(h: Vector, alpha_x: mpf, alpha_y: mpf) -> mpf:
    """Give tan²θ (cos²φ/αx² + sin²φ/αy²) of a facet's normal."""
    return ((h[0] / alpha_x) ** 2 + (h[1] / alpha_y) ** 2) / h[2] ** 2


def schlick(g, p) -> mpf:
    return fresnel.schlick(g.cos_d, p["F0"], p["F90"])


def dielectric(g, p) -> mpf:
    return p["scale"] * fresnel.unpolarised(g.cos_d, p["n"], mpf(0))


def conductor(g, p) -> mpf:
    return p["scale"] * fresnel.unpolarised(g.cos_d, p["n"], p["k"])


def microfacet(names: str, distribution: OfDirection, smith: OfDirection, fresnel_factor) -> Reference:
    """Make a model of a distribution of facets, its Λ and a Fresnel factor."""
    parameters = tuple(names.split())

    def formula(g, p, wavelength):
        alpha = (p["alpha_x"], p["alpha_y"]) if "alpha_x" in p else (p["alpha"], p["alpha"])
        G2 = 1 / (1 + smith(g.incident, *alpha) + smith(g.reflected, *alpha))
        return fresnel_factor(g, p) * distribution(g.half, *alpha) * G2 / (4 * g.cos_i * g.cos_r)

    return Reference(parameters, formula, edges={"k": (0, None)} if "k" in parameters else {})

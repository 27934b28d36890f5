"""Distributions of facets with height-correlated shadowing: D G2 / (4 cosθi cosθr).

Sources: Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293; Walter, Marschner, Li and
Torrance, Eurographics Symposium on Rendering 2007, 195; Heitz, J. Comput. Graph. Tech. 3(2) (2014) 48.
"""

from __future__ import annotations

from clbrdf.models.angles import Geometry
from clbrdf.models.expression import Expression, erfcx, exp, greatest, least, named, sqrt

FARTHEST = 9.0
"""Cotangent of the zenith over α from which shadowing is below e^-81 of the rest."""


def ggx(g: Geometry, alpha: Expression) -> Expression:
    """D of GGX with its shadowing."""
    a2 = alpha**2
    front = named("front", (1.0 + g.tan2_h) ** 2 / (2.0 * g.pi * g.cosines))
    masks = sqrt(1.0 + a2 * tan2(g, "i")) + sqrt(1.0 + a2 * tan2(g, "r"))
    return a2 * front / ((a2 + g.tan2_h) ** 2 * masks)


def ggx_anisotropic(g: Geometry, alpha_x: Expression, alpha_y: Expression) -> Expression:
    """D of GGX with slopes α_x along azimuth 0 of the sample and α_y across, with its shadowing."""
    x, y, z = g.half_vector
    front = named("front", (1.0 + g.tan2_h) ** 2 / (2.0 * g.pi * g.cosines))
    along, across = named("along2", (x / z) ** 2), named("across2", (y / z) ** 2)
    steepness = along / alpha_x**2 + across / alpha_y**2
    masks = g.tape.constant(0.0)
    for side, (tan_x, tan_y) in (("i", g.incident_slopes), ("r", g.view_slopes)):
        x2, y2 = named(f"tan2_x_{side}", tan_x**2), named(f"tan2_y_{side}", tan_y**2)
        masks = masks + sqrt(1.0 + alpha_x**2 * x2 + alpha_y**2 * y2)
    return front / (alpha_x * alpha_y * (1.0 + steepness) ** 2 * masks)


def beckmann(g: Geometry, alpha: Expression) -> Expression:
    """D of Beckmann with its shadowing."""
    a2 = 1.0 / alpha**2
    front = named("front", (1.0 + g.tan2_h) ** 2 / (4.0 * g.pi * g.cosines))
    masks = 1.0 + _shadow(g, "i", alpha) + _shadow(g, "r", alpha)
    return a2 * front * exp(-(g.tan2_h * a2)) / masks


def _shadow(g: Geometry, side: str, alpha: Expression) -> Expression:
    """Smith's Λ = ½ e^(−a²) [1/(a√π) − erfcx(a)], a = cotθ/α: what is hidden per what is seen."""
    sine, cosine = (getattr(g, f"{name}_{side}") for name in ("sin", "cos"))
    cot = named(f"cot_{side}", cosine / greatest(sine, 1e-12))
    a = least(cot / alpha, FARTHEST)
    return 0.5 * exp(-(a**2)) * (1.0 / (a * sqrt(g.pi)) - erfcx(a))


def tan2(g: Geometry, side: str) -> Expression:
    """tan²θ of one side."""
    sine, cosine = (getattr(g, f"{name}_{side}") for name in ("sin", "cos"))
    return named(f"tan2_{side}", (sine / cosine) ** 2)

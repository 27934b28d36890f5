"""Fresnel reflectances of unpolarised light, as expressions of θd, the angle at the facet.

Source: Born and Wolf, Principles of Optics (7th ed., 1999), sections 1.5 and 14.2.
"""

from __future__ import annotations

from clbrdf.models.angles import Geometry
from clbrdf.models.expression import Expression, magnitude, named, sqrt, where

TINY = 1e-30
"""Added where a root of 0 would be divided by; far below what its neighbours can show."""


def schlick(g: Geometry, F0: Expression, F90: Expression) -> Expression:
    """F0 (1 − u) + F90 u, u = (1 − cosθd)⁵: Schlick's, linear in both.

    Source: Schlick, Comput. Graph. Forum 13 (1994) 233, doi:10.1111/1467-8659.1330233.
    """
    return F0 * named("less_schlick", 1.0 - g.schlick) + F90 * g.schlick


def dielectric(g: Geometry, n: Expression) -> Expression:
    """Reflectance of a dielectric of index n > 1."""
    c = g.cos_d
    total = sqrt(n**2 - 1.0 + g.cos2_d) + c
    less = (n**2 - 1.0) / total
    ratio = (c * total - 1.0) / (c * less + 1.0)
    return 0.5 * (less / total) ** 2 * (1.0 + ratio**2)


def conductor(g: Geometry, n: Expression, k: Expression) -> Expression:
    """Reflectance of a conductor of index η = n + ik.

    With r = √(η² − sin²θd) the difference r − c is (η² − 1) / (r + c), which keeps its digits where η is
    near 1.
    """
    c, c2, s2 = g.cos_d, g.cos2_d, g.sin2_d
    a, b = complex_root(c2 + (n - 1.0) * (n + 1.0) - k**2, 2.0 * n * k)
    total = (a + c) ** 2 + b**2
    R_s = ((n - 1.0) ** 2 + k**2) * ((n + 1.0) ** 2 + k**2) / (total**2 + TINY)
    ac, bc2 = a * c, b**2 * c2
    R_p = R_s * ((ac - s2) ** 2 + bc2) / ((ac + s2) ** 2 + bc2)
    return 0.5 * (R_s + R_p)


def complex_root(re: Expression, im: Expression) -> tuple[Expression, Expression]:
    """Return (a, b) with (a + ib)² = re + i im, for im ≥ 0: a, b ≥ 0, without cancellation."""
    larger = sqrt((sqrt(re**2 + im**2) + magnitude(re)) * 0.5 + TINY)
    smaller = im * 0.5 / larger
    return where(re < 0.0, smaller, larger), where(re < 0.0, larger, smaller)

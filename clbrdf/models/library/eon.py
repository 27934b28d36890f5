"""EON: the energy-preserving Oren–Nayar base of Portsmouth, Kutz and Hill.

    f    = ρ/π A (1 + r s/t) + ρms/π A r (c1 − G(μi)/π)(c1 − G(μr)/π) / (c1 − c2)
    s    = sinθi sinθr cosφ;  t = max(cosθi, cosθr) where s > 0, else 1
    A    = 1 / (1 + c1 r),  c1 = 1/2 − 2/(3π),  c2 = 2/3 − 28/(15π)
    ρms  = ρ² Ē / (1 − ρ (1 − Ē)),  Ē = A (1 + c2 r)
    G(μ) = S (acos μ − S μ) + ⅔ [S μ (1 + S + S²)/(1 + S) − S],  S = √(1 − μ²)

The second term is what facets send to each other. The form has no 0/0 at r = 0 or at grazing.
"""

from clbrdf.models.expression import atan2, named, where
from clbrdf.models.page import BOUNDED, RECIPROCAL, model, shape


def missing(g, cosine, sine, c1):
    """c1 − G/π: what single scattering loses, over r A, towards a zenith."""
    angle = atan2(sine, cosine)
    scattered = sine * (angle - sine * cosine) + 2.0 / 3.0 * (
        sine * cosine * (1.0 + sine + sine**2) / (1.0 + sine) - sine
    )
    return c1 - scattered / g.pi


def value(g, rho, r):
    """Record the value."""
    c1, c2 = 0.5 - 2.0 / (3.0 * g.pi), 2.0 / 3.0 - 28.0 / (15.0 * g.pi)
    sines = g.sin_i * g.sin_r
    # 1 + s/t; forward at grazing it is nearly 0, and formed without cancellation.
    forward = g.cosines + 2.0 * g.sin_h**2 + 2.0 * sines * g.cos_p**2
    single = named("single", where(g.cos_phi > 0.0, 1.0 + sines * g.cos_phi / g.largest_cosine, forward))
    multiple = missing(g, g.cos_i, g.sin_i, c1) * missing(g, g.cos_r, g.sin_r, c1) / (g.pi * (c1 - c2))
    A = 1.0 / (1.0 + c1 * r)
    E = A * (1.0 + c2 * r)
    rho_ms = rho**2 * E / (1.0 - rho * (1.0 - E))
    return rho / g.pi * A * (1.0 - r + r * single) + rho_ms * A * r * named("multiple", multiple)


MODEL = model(
    title="EON, energy-preserving Oren–Nayar",
    source="Portsmouth, Kutz and Hill, EON (2024), arXiv:2410.18026",
    parameters=[
        shape("rho", "1", 0.5, (0.0, 1.0), "reflectance of the facets"),
        shape("r", "1", 0.3, (0.0, 1.0), "roughness"),
    ],
    value=value,
    kind="base",
    flags=RECIPROCAL | BOUNDED,
)

"""Oren and Nayar's rough Lambertian facets, in the qualitative form.

    f = ρ/π [A + B max(0, cosφ) sinθi sinθr / max(cosθi, cosθr)]
    A = 1 − σ² / (2 (σ² + 0.33)),  B = 0.45 σ² / (σ² + 0.09)

φ is the azimuth between view and source: it brightens towards the source. It does not preserve energy; eon
does.
"""

from clbrdf.models.expression import greatest, named
from clbrdf.models.page import RECIPROCAL, Example, linear, model, shape


def value(g, rho, sigma):
    """Record the value."""
    backward = named("backward", greatest(g.cos_phi, 0.0) * g.sin_i * g.sin_r / g.largest_cosine)
    s2 = sigma**2
    return rho / g.pi * (1.0 - 0.5 * s2 / (s2 + 0.33) + 0.45 * s2 / (s2 + 0.09) * backward)


MODEL = model(
    title="Oren and Nayar 1994, qualitative",
    source="Oren and Nayar, SIGGRAPH 1994, 239, doi:10.1145/192161.192213",
    parameters=[
        linear("rho", "1", 0.5, (0.0, 1.2), "reflectance of the facets"),
        shape("sigma", "rad", 0.3, (0.0, 1.5), "standard deviation of the facets' slope angle"),
    ],
    value=value,
    kind="base",
    flags=RECIPROCAL,
    examples=[
        Example({"rho": 1.0, "sigma": 0.0}, (30.0, 40.0, 10.0), 0.3183098861837907, "σ = 0 is Lambert's law")
    ],
)

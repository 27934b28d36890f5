"""Beckmann facets of a dielectric.

    f = scale · D G F / (4 cosθi cosθr),  D = (1 + tan²θh)² exp(−tan²θh/α²) / (π α²)

F is Fresnel's reflectance for an index n. In one plane of incidence n and scale are nearly the same: fix n
where it is known.
"""

from clbrdf.models.fresnel import dielectric
from clbrdf.models.microfacet import beckmann
from clbrdf.models.page import BOUNDED, RECIPROCAL, linear, log_shape, model, shape

MODEL = model(
    title="Beckmann facets of a dielectric",
    source="Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293",
    parameters=[
        log_shape("alpha", "1", 0.1, (0.002, 1.5), "root mean square slope of the facets, times √2"),
        shape("n", "1", 1.5, (1.1, 4.0), "refractive index"),
        linear("scale", "1", 1.0, (0.0, 1.0), "share of the surface that the facets cover"),
    ],
    value=lambda g, alpha, n, scale: scale * (beckmann(g, alpha) * dielectric(g, n)),
    flags=RECIPROCAL | BOUNDED,
)

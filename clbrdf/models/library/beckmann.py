"""Beckmann facets with Schlick's Fresnel reflectance.

    f = D G F / (4 cosθi cosθr),  D = (1 + tan²θh)² exp(−tan²θh/α²) / (π α²)
    F = F0 (1 − u) + F90 u,  u = (1 − cosθd)⁵

G is Smith's shadowing and masking, height-correlated (`clbrdf.models.microfacet`). F0 and F90 enter linearly;
F90 is 1 where F is a reflectance.
"""

from clbrdf.models.fresnel import schlick
from clbrdf.models.microfacet import beckmann
from clbrdf.models.page import BOUNDED, RECIPROCAL, linear, log_shape, model

MODEL = model(
    title="Beckmann facets, Schlick's Fresnel reflectance",
    source="Cook and Torrance, ACM Trans. Graph. 1 (1982) 7, doi:10.1145/357290.357293",
    parameters=[
        log_shape("alpha", "1", 0.1, (0.002, 1.5), "root mean square slope of the facets, times √2"),
        linear("F0", "1", 0.05, (0.0, 1.0), "reflectance of a facet at normal incidence"),
        linear("F90", "1", 1.0, (0.0, 1.0), "reflectance of a facet at grazing incidence"),
    ],
    value=lambda g, alpha, F0, F90: beckmann(g, alpha) * schlick(g, F0, F90),
    flags=RECIPROCAL | BOUNDED,
)

"""GGX facets with Schlick's Fresnel reflectance.

    f = D G F / (4 cosθi cosθr),  D = (1 + tan²θh)² / (π α² (1 + tan²θh/α²)²)
    F = F0 (1 − u) + F90 u,  u = (1 − cosθd)⁵

G is Smith's shadowing and masking, height-correlated (`clbrdf.models.microfacet`). F0 and F90 enter linearly;
F90 is 1 where F is a reflectance.
"""

from clbrdf.models.fresnel import schlick
from clbrdf.models.microfacet import ggx
from clbrdf.models.page import BOUNDED, RECIPROCAL, linear, log_shape, model

MODEL = model(
    title="GGX facets, Schlick's Fresnel reflectance",
    source="Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206",
    parameters=[
        log_shape("alpha", "1", 0.1, (0.002, 1.5), "width of the slopes of the facets"),
        linear("F0", "1", 0.05, (0.0, 1.0), "reflectance of a facet at normal incidence"),
        linear("F90", "1", 1.0, (0.0, 1.0), "reflectance of a facet at grazing incidence"),
    ],
    value=lambda g, alpha, F0, F90: ggx(g, alpha) * schlick(g, F0, F90),
    flags=RECIPROCAL | BOUNDED,
)

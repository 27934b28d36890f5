"""GGX facets of a metal.

    f = scale · D G F / (4 cosθi cosθr),  D = (1 + tan²θh)² / (π α² (1 + tan²θh/α²)²)

F is Fresnel's reflectance for an index n + ik. In one plane of incidence n, k and scale are nearly the
same: fix n and k where they are known.
"""

from clbrdf.models.fresnel import conductor
from clbrdf.models.microfacet import ggx
from clbrdf.models.page import BOUNDED, RECIPROCAL, linear, log_shape, model, shape

MODEL = model(
    title="GGX facets of a metal",
    source="Walter et al., Eurographics Symposium on Rendering (2007) 195, doi:10.2312/EGWR/EGSR07/195-206",
    parameters=[
        log_shape("alpha", "1", 0.1, (0.002, 1.5), "width of the slopes of the facets"),
        shape("n", "1", 1.5, (0.05, 8.0), "refractive index, real part"),
        shape("k", "1", 3.0, (0.0, 12.0), "refractive index, imaginary part"),
        linear("scale", "1", 1.0, (0.0, 1.0), "share of the surface that the facets cover"),
    ],
    value=lambda g, alpha, n, k, scale: scale * (ggx(g, alpha) * conductor(g, n, k)),
    flags=RECIPROCAL | BOUNDED,
)

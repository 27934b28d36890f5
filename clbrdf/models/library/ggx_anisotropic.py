"""GGX facets with two slopes, for brushed surfaces, with Schlick's Fresnel reflectance.

    f = D G F / (4 cosθi cosθr),  D = 1 / (π αx αy cos⁴θh [1 + (hx/(αx hz))² + (hy/(αy hz))²]²)

αx is the width of the slopes along azimuth 0 of the sample, αy that across.
"""

from clbrdf.models.fresnel import schlick
from clbrdf.models.microfacet import ggx_anisotropic
from clbrdf.models.page import BOUNDED, NEEDS_PHI, RECIPROCAL, linear, log_shape, model

MODEL = model(
    title="GGX facets, anisotropic, Schlick's Fresnel reflectance",
    source="Heitz, J. Comput. Graph. Tech. 3(2) (2014) 48",
    parameters=[
        log_shape("alpha_x", "1", 0.1, (0.002, 1.5), "width of the slopes along azimuth 0"),
        log_shape("alpha_y", "1", 0.2, (0.002, 1.5), "width of the slopes along azimuth 90°"),
        linear("F0", "1", 0.05, (0.0, 1.0), "reflectance of a facet at normal incidence"),
        linear("F90", "1", 1.0, (0.0, 1.0), "reflectance of a facet at grazing incidence"),
    ],
    value=lambda g, alpha_x, alpha_y, F0, F90: ggx_anisotropic(g, alpha_x, alpha_y) * schlick(g, F0, F90),
    flags=RECIPROCAL | BOUNDED | NEEDS_PHI,
)

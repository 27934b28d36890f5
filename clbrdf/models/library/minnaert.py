"""Minnaert's law: a base that darkens or brightens towards the limb.

    f = ρ (k + 1) / (2π) · (cosθi cosθr)^(k − 1)

k = 1 is Lambert's law with ρ. For k < 1 it grows without bound towards grazing.
"""

from clbrdf.models.expression import exp, log
from clbrdf.models.page import RECIPROCAL, Example, linear, model, shape

MODEL = model(
    title="Minnaert's law",
    source="Minnaert, Astrophys. J. 93 (1941) 403, doi:10.1086/144279",
    parameters=[
        linear("rho", "1", 0.5, (0.0, 1.5), "directional-hemispherical reflectance at normal incidence"),
        shape("k", "1", 1.0, (0.3, 2.0), "limb darkening; 1 is Lambert's law"),
    ],
    value=lambda g, rho, k: rho * (k + 1.0) * exp((k - 1.0) * log(g.cosines)) / (2.0 * g.pi),
    kind="base",
    flags=RECIPROCAL,
    examples=[
        Example({"rho": 0.7, "k": 1.0}, (60.0, 20.0, 90.0), 0.7 / 3.141592653589793, "k = 1 is Lambert's law")
    ],
)

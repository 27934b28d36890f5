"""RPV: soil and vegetation, with a bowl or a bell, forward or backward scattering, and a hot spot.

    f = ρ0/π [cosθi cosθr (cosθi + cosθr)]^(k − 1) (1 − Θ²) / (1 + Θ² + 2Θ cosξ)^1.5 [1 + (1 − ρc) / (1 + Δ)]

ξ is the phase angle and Δ the distance of (11). ρc = 1 switches the hot spot off.
"""

from clbrdf.models.expression import exp, log, magnitude, named, sqrt, where
from clbrdf.models.page import RECIPROCAL, linear, model, shape


def value(g, rho0, k, Theta, rho_c):
    """Record the value."""
    size = magnitude(Theta)
    scatter = (1.0 - size) ** 2 + 4.0 * size * where(Theta < 0.0, g.sin2_d, g.cos2_d)
    bowl = exp((k - 1.0) * named("log_bowl", log(g.cosines * (g.cos_i + g.cos_r))))
    spot = 1.0 + (1.0 - rho_c) * named("near", 1.0 / (1.0 + g.delta))
    return rho0 * (1.0 - Theta**2) * bowl * spot / (g.pi * scatter * sqrt(scatter))


MODEL = model(
    title="Rahman, Pinty and Verstraete 1993",
    source="Rahman, Pinty and Verstraete, J. Geophys. Res. 98 (1993) 20791, doi:10.1029/93JD02072",
    parameters=[
        linear("rho0", "1", 0.1, (0.0, 1.0), "brightness"),
        shape("k", "1", 0.8, (0.3, 1.5), "bowl below 1, bell above"),
        shape("Theta", "1", -0.1, (-0.6, 0.3), "scattering, backward below 0"),
        shape("rho_c", "1", 0.1, (0.0, 1.0), "hot spot; often taken equal to rho0, and 1 is none"),
    ],
    value=value,
    kind="whole",
    flags=RECIPROCAL,
)

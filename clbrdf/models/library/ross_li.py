"""Ross–Li: kernels of a leaf canopy and of shadowed crowns, linear in all three weights.

    f = (f_iso + f_vol Kv + f_geo Kg) / π

Kv is the Ross-thick kernel, Kg the reciprocal Li-sparse kernel with h/b = 2 and b/r = 1. f can be negative:
Kg is about −3 at 60° forward.
"""

from clbrdf.models.expression import atan2, greatest, least, named, sqrt
from clbrdf.models.page import RECIPROCAL, SIGNED, linear, model


def value(g, f_iso, f_vol, f_geo):
    """Record the value."""
    cos_phase = g.cos2_d - g.sin2_d
    sin_phase = 2.0 * g.cos_d * sqrt(g.sin2_d)
    volume = ((g.pi / 2.0 - g.phase) * cos_phase + sin_phase) / (g.cos_i + g.cos_r) - g.pi / 4.0
    secants = 1.0 / g.cos_i + 1.0 / g.cos_r
    across = g.sin_i * g.sin_r * 2.0 * g.sin_p * g.cos_p / g.cosines
    cos_t = least(2.0 * sqrt(g.delta**2 + across**2) / secants, 1.0)
    sin_t = sqrt(greatest((1.0 - cos_t) * (1.0 + cos_t), 0.0))
    crowns = (atan2(sin_t, cos_t) - sin_t * cos_t) * secants / g.pi - secants + g.cos2_d / g.cosines
    return f_iso / g.pi + f_vol * named("volume", volume / g.pi) + f_geo * named("crowns", crowns / g.pi)


MODEL = model(
    title="Ross-thick, Li-sparse kernels",
    source="Lucht, Schaaf and Strahler, IEEE TGRS 38 (2000) 977, doi:10.1109/36.841980",
    parameters=[
        linear("f_iso", "1", 0.3, (-2.0, 2.0), "weight of the isotropic kernel"),
        linear("f_vol", "1", 0.1, (-2.0, 2.0), "weight of the volume kernel"),
        linear("f_geo", "1", 0.03, (-2.0, 2.0), "weight of the geometric kernel"),
    ],
    value=value,
    kind="whole",
    flags=RECIPROCAL | SIGNED,
)

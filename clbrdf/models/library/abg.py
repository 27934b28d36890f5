"""ABg, of the Harvey–Shack family: scatter of polished surfaces over the distance from the mirror direction.

    f = A / (B + x^g) = b0 / (1 + (x/x_k)^g),   x = |β − β0|

b0 = A/B is the height of the plateau and x_k = B^(1/g) the knee: both are seen in a plot, and far less tied
together than A and B. For g < 2 the lobe has a cusp at x = 0. The energy is not bounded.
"""

from clbrdf.models.expression import exp, log
from clbrdf.models.page import RECIPROCAL, linear, log_shape, model, shape

MODEL = model(
    title="ABg scatter",
    source="Harvey, PhD thesis, University of Arizona (1976)",
    parameters=[
        linear("b0", "1/sr", 1.0, (1e-6, 1e6), "height of the plateau, A/B", log_floor=1e-6),
        log_shape("x_k", "1", 0.01, (1e-4, 0.5), "|β − β0| at the knee, B^(1/g)"),
        shape("g", "1", 1.5, (0.5, 3.5), "steepness beyond the knee"),
    ],
    value=lambda g, b0, x_k, steep: b0 / (1.0 + exp(steep * (log(g.x) - log(x_k)))),
    flags=RECIPROCAL,
)

"""K-correlation: scatter of polished surfaces whose power spectrum is flat, then falls as a power law.

    f = b0 [1 + (x/l)²]^(−C/2),   x = |β − β0|

C = 2 is ABg with g = 2. Harvey's slope S is −C.
"""

from clbrdf.models.expression import exp, log1p, named
from clbrdf.models.page import RECIPROCAL, linear, log_shape, model, shape

MODEL = model(
    title="K-correlation scatter",
    source="Dittman, Proc. SPIE 6291 (2006) 62910R, doi:10.1117/12.678320",
    parameters=[
        linear("b0", "1/sr", 1.0, (1e-6, 1e6), "height of the plateau", log_floor=1e-6),
        log_shape("l", "1", 0.01, (1e-4, 0.5), "|β − β0| at the shoulder"),
        shape("C", "1", 2.0, (1.0, 5.0), "steepness beyond the shoulder"),
    ],
    value=lambda g, b0, length, C: b0 * exp(-0.5 * C * log1p(named("x2", 4.0 * g.q) / length**2)),
    flags=RECIPROCAL,
)

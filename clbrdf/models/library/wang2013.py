"""The six-parameter spectral model of Wang, Zhang and Dong (2013).

    f = ks D G F / (π cosθi cosθr) + kd / π                                    (8)
    D = exp[c (1 − cosγ)^d]              peak around the mirror direction      (9)
    G = √(tan²θi + tan²θr − 2 tanθi tanθr cosφ)                                (11)
    F = exp[a (b − cosθi)²]              growth with the incident angle        (12)

with γ of (10), half the angle between view and mirror direction. G is 0 in the retro direction and grows
without bound towards grazing; F depends on θi alone, so the model is not reciprocal, and the parameters of
Table 1 do not conserve energy. Its kernel is tuned by hand (kernels/models/wang2013.cl,
`clbrdf.models.tuned.wang2013`).
"""

from clbrdf.models.expression import exp, log, named
from clbrdf.models.page import NONE, Example, Term, linear, model, shape
from clbrdf.models.parameter import Parameter


def value(g, a, b, c, d, ks, kd, left_out):
    """Record the value without some terms."""
    diffuse = g.tape.constant(0.0) if "diffuse" in left_out else kd / g.pi
    if "specular" in left_out:
        return diffuse
    if "attenuation" in left_out:
        log_s = -log(g.cosines * g.pi)
    else:
        log_s = log(g.delta_times_cosines / (g.pi * g.cosines**2))
    level = named("log_s", log_s)
    if "fresnel" not in left_out:
        level = level + a * (b - g.cos_i) ** 2
    lobe = exp(c * exp(d * named("log_v", log(g.one_minus_cos_gamma))) + level)
    return ks * lobe + diffuse


FOIL = {"a": 3.87, "b": 0.5216, "c": -300.0, "d": 0.74, "ks": 451.7958, "kd": 1.3034}

MODEL = model(
    title="Wang, Zhang and Dong 2013, six parameters",
    source="Wang, Zhang and Dong, Measurement 46 (2013) 3654",
    parameters=[
        shape("a", "1", 3.87, (-20.0, 20.0), "strength of the Fresnel factor F (12)"),
        shape("b", "1", 0.5216, (-1.0, 2.0), "cosine of the incident angle where F is 1 (12)"),
        Parameter("c", "1", -300.0, (-1e6, 0.0), "steepness of the lobe D (9)", "log", 1e-9),
        shape("d", "1", 0.74, (0.2, 2.0), "shape of the lobe D (9)"),
        linear("ks", "1", 451.7958, (0.0, 1e5), "weight of the specular lobe (8)", log_floor=1e-12),
        linear("kd", "1", 1.3034, (0.0, 10.0), "weight of the diffuse term (8)", log_floor=1e-12),
    ],
    value=value,
    kind="whole",
    flags=NONE,
    terms=[
        Term("specular", "the lobe ks D G F / (π cosθi cosθr) of (8)", ("c", "d", "ks")),
        Term("fresnel", "the factor F of (12)", ("a", "b"), "specular"),
        Term("attenuation", "the factor G of (11)", (), "specular"),
        Term("diffuse", "the summand kd / π of (8)", ("kd",), base=True),
    ],
    grazing=["ks"],
    examples=[
        # Table 1, in the mirror direction, where D = 1 and G = 2 tanθ.
        Example(FOIL, (30.0, 30.0, 180.0), 350.8296, "the closed form at the peak"),
        Example(FOIL, (60.0, 60.0, 180.0), 1996.7208, "the closed form at the peak"),
    ],
)

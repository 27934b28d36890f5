"""Lambert's cosine law: a surface that looks equally bright from everywhere.

f = ρ/π
"""

from clbrdf.models.page import BOUNDED, RECIPROCAL, Example, linear, model

MODEL = model(
    title="Lambert's cosine law",
    source="Lambert, Photometria (1760)",
    parameters=[linear("rho", "1", 0.5, (0.0, 1.2), "reflectance")],
    value=lambda g, rho: rho / g.pi,
    kind="base",
    flags=RECIPROCAL | BOUNDED,
    examples=[Example({"rho": 1.0}, (30.0, 40.0, 10.0), 0.3183098861837907, "1/π")],
)

"""Terms of the model on and off: values, kernels, and sources without what is off."""

from __future__ import annotations

import pickle
from itertools import combinations

import numpy as np
import pytest

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import get_model, restrict
from clbrdf.opencl.precision import PRECISIONS
from clbrdf.opencl.program import Variant, only, source_text
from clbrdf.opencl.values import evaluate_directions
from tests.reference import naive

TERMS = ("specular", "fresnel", "attenuation", "diffuse")
SETS = [set(left) for count in range(4) for left in combinations(TERMS, count)]
SETS = [left for left in SETS if not {"specular", "diffuse"} <= left]

ANGLES = (
    np.array([30.0, 45.0, 60.0, 5.0, 75.0]),
    np.array([31.0, 10.0, 62.0, 80.0, 74.0]),
    np.array([180.0, 90.0, 175.0, 20.0, 181.0]),
)


def published(left_out):
    """Equation (8) with its terms by name, each as the paper prints it."""
    a, b, c, d, ks, kd = naive.TIN_FOIL
    i, r, p = (np.deg2rad(angle) for angle in ANGLES)
    v = 1 - np.sqrt((np.cos(i) * np.cos(r) - np.sin(i) * np.sin(r) * np.cos(p) + 1) / 2)
    D = np.exp(c * v**d)
    G = np.sqrt(np.tan(i) ** 2 + np.tan(r) ** 2 - 2 * np.tan(i) * np.tan(r) * np.cos(p))
    F = np.exp(a * (b - np.cos(i)) ** 2)
    specular = ks * D / (np.pi * np.cos(i) * np.cos(r))
    specular = specular * (1 if "attenuation" in left_out else G) * (1 if "fresnel" in left_out else F)
    return (0 if "specular" in left_out else specular) + (0 if "diffuse" in left_out else kd / np.pi)


@pytest.mark.parametrize("precision", ["fast", "single", "double"])
@pytest.mark.parametrize("left_out", SETS, ids=lambda left: "-".join(sorted(left)) or "none")
def test_values(device, left_out, precision):
    model = restrict(get_model(), frozenset(left_out))
    arithmetic = PRECISIONS["fast:4" if precision == "fast" else precision]
    ours = evaluate_directions(model, model.defaults[None], Directions.relative(*ANGLES), arithmetic, device)[
        :, 0
    ]
    # The paper's form of 1 − cosγ loses digits near the mirror direction: 1e-10 is left at 1°.
    # Bounds hold above 1e-30.
    rtol = max(arithmetic.bound, 1e-10)
    np.testing.assert_allclose(ours, published(left_out), rtol=rtol, atol=1e-30)


@pytest.mark.parametrize("left_out", SETS, ids=lambda left: "-".join(sorted(left)) or "none")
def test_what_is_off_is_not_in_the_source(device, left_out):
    model = restrict(get_model(), frozenset(left_out))
    text = source_text(Variant.on(device, "evaluate", model, PRECISIONS["double"]))
    gone = left_out | ({"fresnel", "attenuation"} if "specular" in left_out else set())
    for name in ("a", "b", "c", "d", "ks", "kd"):
        belongs = {"a": "fresnel", "b": "fresnel", "kd": "diffuse"}.get(name, "specular")
        assert (f"p[P_{name}]" in text) == (belongs not in gone)
        assert (f"#define P_{name} " in text) == (belongs not in gone)
    exponentials = model.kernel().split("model_brdf(")[1].split("}")[0].count("exp")
    assert exponentials == (0 if "specular" in gone else 2)
    assert "//@" not in text


def test_host_and_jacobian_agree():
    model = restrict(get_model(), frozenset({"fresnel"}))
    p, x = model.defaults[None], model.features(Directions.relative(*ANGLES))
    np.testing.assert_allclose(model.brdf(p, x), published({"fresnel"}), rtol=1e-10)
    step = 1e-6 * p[0]
    for j in range(len(model.names)):
        up, down = (p + s * step * (np.arange(len(step)) == j) for s in (1, -1))
        slope = (model.brdf(up, x) - model.brdf(down, x)) / (2 * step[j])
        # Central differences with a step of 1e-6: 1e-9 of truncation, 1e-9 of rounding.
        np.testing.assert_allclose(model.jacobian(p, x)[..., j], slope, rtol=1e-6, atol=1e-12)


def test_nothing_left_out_is_the_model_itself():
    assert restrict(get_model(), frozenset()) is get_model()


def test_a_factor_goes_with_its_summand():
    model = restrict(get_model(), frozenset({"specular"}))
    assert model.names == ("kd",)
    assert model.feature_names == ()
    assert model.name == "wang2013-specular"
    assert [term.name for term in model.terms] == ["diffuse"]


def test_it_travels_to_another_process():
    model = restrict(get_model(), frozenset({"diffuse"}))
    assert pickle.loads(pickle.dumps(model)) is model


def test_parts_of_a_sum_are_terms_too():
    whole = get_model("wang2013+eon")
    assert [term.name for term in whole.terms][:2] == ["wang2013", "wang2013.specular"]
    base = restrict(whole, frozenset({"wang2013"}))
    assert base.names == ("eon.rho", "eon.r")
    lobe = restrict(whole, frozenset({"eon", "wang2013.fresnel"}))
    assert lobe.names == ("wang2013.c", "wang2013.d", "wang2013.ks")
    assert pickle.loads(pickle.dumps(lobe)) is lobe


def test_what_is_no_term_is_refused():
    with pytest.raises(InputError, match="has no term 'gloss'; it has attenuation, diffuse"):
        restrict(get_model(), frozenset({"gloss"}))
    with pytest.raises(InputError, match="leaves nothing that reflects"):
        restrict(get_model("ggx+lambert"), frozenset({"ggx", "lambert"}))


def test_markers():
    text = "a\nb  //@one\nc  //@two\ne"
    assert only(text, ["one"]) == "a\nb\n\ne"

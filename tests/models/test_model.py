"""The parameter table, its coordinates, and room for further models."""

from __future__ import annotations

import pickle
import re
from importlib import resources

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf import InputError, evaluate
from clbrdf.models import get_model, model_names, tuned, written_kernel

MODEL = get_model()


@pytest.mark.parametrize("name", model_names())
def test_the_kernel_on_disk_is_what_follows_from_the_page(name):
    file = resources.files("clbrdf.kernels").joinpath(f"models/{name}.cl")
    if name in tuned.NAMES:
        pytest.skip("written by hand; tests/models hold its values to the page")
    assert file.read_text(encoding="utf-8") == written_kernel(name), "run 'make kernels'"


@pytest.mark.parametrize("name", model_names())
def test_each_table_is_complete(name):
    model = get_model(name)
    used = set(re.findall(r"p\[P_(\w+)\]", model.kernel()))
    assert used == {p.symbol for p in model.parameters}
    assert set(re.findall(r"\bx\.(\w+)", model.kernel())) == set(model.feature_names)
    assert model.source
    for p in model.parameters:
        assert p.bounds[0] <= p.default <= p.bounds[1]
        assert p.meaning


@pytest.mark.parametrize("name", model_names())
def test_examples_of_the_page(name):
    model = get_model(name)
    for example in model.examples:
        value = evaluate(dict(example.parameters), *example.angles, model=name)[0]
        assert value == pytest.approx(example.value, rel=1e-6), example.source


def test_default_bounds_are_those_of_the_brief():
    assert {p.name: p.bounds for p in MODEL.parameters} == {
        "a": (-20.0, 20.0),
        "b": (-1.0, 2.0),
        "c": (-1e6, 0.0),
        "d": (0.2, 2.0),
        "ks": (0.0, 1e5),
        "kd": (0.0, 10.0),
    }


@given(share=st.floats(1e-3, 0.999))
def test_coordinates_invert(share):
    bounds = MODEL.bounds()
    limits = MODEL.coordinate_bounds(bounds)
    q = limits[:, 0] + share * (limits[:, 1] - limits[:, 0])
    values = MODEL.from_coordinates(q)
    assert ((values >= bounds[:, 0]) & (values <= bounds[:, 1])).all()
    np.testing.assert_allclose(MODEL.to_coordinates(values), q, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("parameter", MODEL.parameters, ids=lambda p: p.name)
def test_slope_is_the_derivative_of_the_value(parameter):
    q, step = parameter.to_coordinate(parameter.default), 1e-6
    secant = (parameter.from_coordinate(q + step) - parameter.from_coordinate(q - step)) / (2 * step)
    assert parameter.slope(parameter.default) == pytest.approx(secant, rel=1e-8)


def test_given_bounds_replace_the_tables():
    assert MODEL.bounds({"d": (0.5, 1.0)})[3].tolist() == [0.5, 1.0]


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"e": (0.0, 1.0)}, "no parameter 'e'"),
        ({"d": (1.0, 1.0)}, "bounds of d"),
        ({"d": (2.0, 1.0)}, "bounds of d"),
        ({"d": (np.nan, 1.0)}, "bounds of d"),
        ({"c": (-10.0, 10.0)}, "both have to be at most 0"),
        ({"ks": (-1.0, 10.0)}, "both have to be at least 0"),
    ],
)
def test_impossible_bounds_are_refused(bounds, message):
    with pytest.raises(InputError, match=message):
        MODEL.bounds(bounds)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"x": 1.0}, "no parameter 'x'"),
        ({"a": np.inf}, "parameter a is not finite"),
        ({"a": np.ones((2, 2))}, "parameter a has 2 dimensions"),
        ({"a": np.ones(2), "b": np.ones(3)}, r"different lengths \(a: 2, b: 3\)"),
    ],
)
def test_impossible_parameters_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        evaluate(parameters, 30.0, 30.0, 180.0)


def test_unknown_model_and_precision_are_refused():
    with pytest.raises(InputError, match="no model is called 'phong'; there are abg, "):
        evaluate({}, 30.0, 30.0, 180.0, model="phong")
    with pytest.raises(InputError, match="no precision is called 'half'"):
        evaluate({}, 30.0, 30.0, 180.0, precision="half")


def test_models_travel_to_other_processes():
    assert pickle.loads(pickle.dumps(MODEL)) is MODEL

"""From a tolerance to the cheapest precision that keeps it."""

from __future__ import annotations

import numpy as np
import pytest

import clbrdf
from clbrdf import InputError, choose_precision
from clbrdf.models import get_model
from clbrdf.opencl.answers import keep_answer, read_answer
from clbrdf.opencl.cheapest import TOPIC, known_costs, measure_costs
from clbrdf.opencl.precision import PRECISIONS


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CLBRDF_CACHE_DIR", str(tmp_path))
    read_answer.cache_clear()
    yield
    read_answer.cache_clear()


def test_the_cheapest_measured_that_keeps_it(device):
    costs = {"fast:3": 3.0, "fast:4": 4.0, "fast:5": 5.0, "single": 20.0, "double": 10.0}
    keep_answer(device, TOPIC, costs, get_model().kernel())
    choice = choose_precision(1e-3, device=device)
    assert (choice.precision.name, choice.nanoseconds) == ("fast:4", 4.0)
    assert (choice.better.name, choice.better_nanoseconds) == ("fast:5", 5.0)
    # Single keeps 1e-4 too, and costs more than double here.
    assert choose_precision(1e-4, device=device).precision.name == "double"
    assert choose_precision(1e-12, device=device).better is None
    said = "precision fast:4 (within 0.001), 4 ns a value; "
    said += "the next better is fast:5 (within 0.0003), 5 ns a value"
    assert str(choice) == said


def test_without_measured_costs_the_less_exact_is_taken_for_cheaper(device):
    choice = choose_precision(1e-4, device=device, measure=False)
    assert choice.precision.name == "single"
    assert np.isnan(choice.nanoseconds)
    assert str(choice) == "precision single (within 1e-05); the next better is double (within 5e-13)"


def test_costs_are_measured_once_and_kept(device):
    model = get_model()
    costs = measure_costs(device, model, list(PRECISIONS.values()))
    assert set(costs) == set(PRECISIONS)
    assert all(value > 0.0 for value in costs.values())
    assert known_costs(device, get_model()) == costs


@pytest.mark.parametrize("rtol", [1e-1, 1e-3, 1e-4, 1e-12])
def test_evaluate_keeps_its_word(device, rtol):
    angles = (60.0, np.linspace(0.0, 85.0, 200), 180.0)
    exact = clbrdf.evaluate({}, *angles, precision="reference")
    np.testing.assert_allclose(clbrdf.evaluate({}, *angles, rtol=rtol, device=device), exact, rtol=rtol)


def test_impossible_tolerances_are_refused(device):
    with pytest.raises(InputError, match="5e-13 is the best here; ask for precision 'reference'"):
        choose_precision(1e-13, device=device)
    for rtol in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="give a positive number"):
            choose_precision(rtol, device=device)
    with pytest.raises(InputError, match="give one of them"):
        clbrdf.evaluate({}, 30.0, 30.0, 180.0, precision="double", rtol=1e-3)

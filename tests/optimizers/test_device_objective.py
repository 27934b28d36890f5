"""The OpenCL objective and its NumPy twin are one function."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.bench.problems import problem_set
from clbrdf.fit.problem import make_problem
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.optimizers import minimise
from clbrdf.optimizers.device_objective import DeviceObjective
from clbrdf.optimizers.objective import HUGE, NumpyObjective

MODEL = get_model()


@pytest.fixture
def problem(device):
    scan = problem_set(("six-angles",))[0].scan
    return make_problem(scan, weight_matrix(scan), MODEL, MODEL.bounds(), device)


# fp64: rounding of N terms; fp32: 1e-5 near an optimum, where E is a small difference, and less elsewhere.
@pytest.mark.parametrize(("precision", "rtol"), [("double", 1e-11), ("single", 1e-3)])
def test_values_and_gradients_are_the_twins(problem, precision, rtol):
    ours, twin = DeviceObjective(problem, 1, precision), NumpyObjective(problem, 1)
    centre = MODEL.to_coordinates(MODEL.vector({"c": -90.0, "d": 0.7, "ks": 20.0}))
    for count in (1, 3, 37, 5):  # fewer than lanes, more than before, and fewer again
        q = centre + 0.05 * np.random.default_rng(count).standard_normal((count, 6))
        np.testing.assert_allclose(ours.values(q), twin.values(q), rtol=rtol)
        E, gradient = ours.value_and_gradient(q[0])
        expected_E, expected = twin.value_and_gradient(q[0])
        assert pytest.approx(expected_E, rel=rtol) == E
        np.testing.assert_allclose(gradient, expected, rtol=rtol, atol=rtol * np.abs(expected).max())


def test_what_is_not_finite_is_huge(problem):
    ours = DeviceObjective(problem, 0, "single")
    q = np.array([20.0, -1.0, -30.0, 1.0, 16.0, 0.0])  # F = e^80, squared beyond fp32
    assert ours.values(q[None])[0] == HUGE
    assert ours.value_and_gradient(q)[0] == HUGE


# Along gradients rounding parts them at once, in populations later.
@pytest.mark.parametrize(("name", "same"), [("evolution", 5), ("crs2", 5), ("mlsl-lbfgs", 1)])
def test_optimizers_run_on_either(problem, name, same):
    traces = [
        minimise(name, objective(problem, 0), evaluations=600, seed=4)
        for objective in (NumpyObjective, DeviceObjective)
    ]
    assert [t.spent for t in traces] == [pytest.approx(600, abs=1)] * 2
    np.testing.assert_allclose(traces[0].objective[:same], traces[1].objective[:same], rtol=1e-9)

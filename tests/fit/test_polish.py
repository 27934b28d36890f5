"""The polish alone: bounded least squares against SciPy's."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from clbrdf.fit.polish import MOST_ITERATIONS, TOLERANCE, descend, polish
from clbrdf.fit.problem import make_problem
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.precision import get_precision

MODEL = get_model()


def problem_of(scan, device, bounds=None):
    return make_problem(scan, weight_matrix(scan), MODEL, MODEL.bounds(bounds), device)


def descend_to_the_end(problem, starts):
    return descend(problem, starts, get_precision("double"), MOST_ITERATIONS, TOLERANCE)


def scipy_end(problem, start):
    def residuals(q):
        values = MODEL.brdf(MODEL.from_coordinates(q)[None, :], problem.features)
        return problem.scale[0] * values - problem.target[0]

    end = least_squares(
        residuals,
        start,
        bounds=(problem.lower[0], problem.upper[0]),
        x_scale="jac",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return 2.0 * end.cost


def test_near_starts_end_where_scipy_ends(small_scan, device):
    rng = np.random.default_rng(8)
    scan = small_scan.columns([0])
    problem = problem_of(scan, device, {"d": (0.75, 2.0)})  # the truth, d = 0.74, is out of reach
    truth = MODEL.to_coordinates(np.array([3.87, 0.5216, -300.0, 0.8, 406.0, 1.17]))
    starts = truth + rng.normal(0.0, 0.05, (1, 6, 6))
    starts = np.clip(starts, problem.lower[0], problem.upper[0] - 1e-6)
    ends = polish(problem, starts)
    assert ends.converged.all()
    for k in range(6):
        np.testing.assert_allclose(ends.objective[0, k], scipy_end(problem, starts[0, k] + 1e-9), rtol=1e-8)
    np.testing.assert_array_equal(ends.coordinates[0, :, 3], 0.75)


def test_starts_do_not_disturb_each_other(small_scan, device):
    """Lanes stop at different times; one that is done must not move."""
    rng = np.random.default_rng(9)
    problem = problem_of(small_scan, device)
    starts = problem.lower[0] + (problem.upper - problem.lower)[0] * rng.random((3, 7, 6))
    together = descend_to_the_end(problem, starts)
    for k in range(7):
        alone = descend_to_the_end(problem, starts[:, k : k + 1])
        np.testing.assert_array_equal(alone.coordinates[:, 0], together.coordinates[:, k])
        np.testing.assert_array_equal(alone.objective[:, 0], together.objective[:, k])


def test_no_end_is_worse_than_its_start(small_scan, device):
    rng = np.random.default_rng(10)
    problem = problem_of(small_scan.columns([1]), device)
    starts = problem.lower[0] + (problem.upper - problem.lower)[0] * rng.random((1, 64, 6))
    ends = descend_to_the_end(problem, starts)
    values = MODEL.brdf(MODEL.from_coordinates(starts[0])[:, None, :], problem.features)
    before = ((problem.scale * values - problem.target) ** 2).sum(axis=1)
    assert (ends.objective[0] <= before * (1 + 1e-12)).all()
    assert ((ends.coordinates >= problem.lower[0]) & (ends.coordinates <= problem.upper[0])).all()


def test_the_way_in_single_precision_loses_no_optimum(small_scan, device):
    """From starts as a search gives them, some of them bad, both ways end at the same lowest E."""
    rng = np.random.default_rng(11)
    problem = problem_of(small_scan, device)
    starts = problem.lower[0] + (problem.upper - problem.lower)[0] * rng.random((3, 8, 6))
    truth = MODEL.to_coordinates(np.array([3.87, 0.5216, -300.0, 0.74, 406.0, 1.17]))
    starts[:, ::2] = truth + rng.normal(0.0, 0.2, (3, 4, 6))
    quick, patient = polish(problem, starts), descend_to_the_end(problem, starts)
    # These data are exact: E ends at rounding, about 1e-30, and 1e-24 is as good as 0.
    assert (patient.objective.min(axis=1) < 1e-24).all()
    assert (quick.objective.min(axis=1) < 1e-24).all()
    assert not quick.converged.all()  # some were given up


def test_lanes_left_out_stay_where_they_are(small_scan, device):
    rng = np.random.default_rng(12)
    problem = problem_of(small_scan, device)
    starts = problem.lower[0] + (problem.upper - problem.lower)[0] * rng.random((3, 6, 6))
    left_out = np.array([[False, True, False, True, True, False]] * 3)
    ends = descend(problem, starts, get_precision("double"), 20, TOLERANCE, left_out)
    np.testing.assert_array_equal(ends.coordinates[left_out], starts[left_out])
    assert (ends.evaluations[left_out] == 0).all()
    assert (ends.coordinates[~left_out] != starts[~left_out]).any()

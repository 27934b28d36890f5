"""The objective that optimizers get: equal to (13) as the paper prints it, with true derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from clbrdf import InputError
from clbrdf.fit.problem import make_problem
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.optimizers.independent import search_twice
from clbrdf.optimizers.objective import HUGE, NumpyObjective
from clbrdf.optimizers.separable import SeparableObjective, box_least_squares
from tests.reference import naive

MODEL = get_model()


@pytest.fixture
def problem(small_scan, device):
    noise = np.random.default_rng(1).standard_normal(small_scan.brdf.shape)
    scan = replace(small_scan, brdf=small_scan.brdf * (1.0 + 0.06 * noise))
    return scan, make_problem(scan, weight_matrix(scan), MODEL, MODEL.bounds(), device)


def points(problem, count, seed=0):
    """Coordinates about a third of the box away from the tin foil, and inside it."""
    rng = np.random.default_rng(seed)
    centre = MODEL.to_coordinates(np.array(naive.TIN_FOIL))
    q = centre + 0.1 * rng.standard_normal((count, 6)) * np.array([10.0, 1.0, 10.0, 1.0, 10.0, 10.0])
    return np.clip(q, problem.lower[0], problem.upper[0])


def test_values_are_equation_13(problem):
    scan, p = problem
    q = points(p, 20)
    for w in range(3):
        E = NumpyObjective(p, w).values(q)
        expected = [naive.objective(x, scan, w) for x in MODEL.from_coordinates(q)]
        # The naive cosγ loses digits near the peak, where 1 − cosγ is 1e-4 and smaller.
        np.testing.assert_allclose(E, expected, rtol=1e-9)


def test_gradients_are_those_of_the_values(problem):
    objective = NumpyObjective(problem[1], 1)
    for q in points(problem[1], 10):
        E, gradient = objective.value_and_gradient(q)
        assert objective.values(q[None])[0] == pytest.approx(E, rel=1e-12)
        steps = 1e-5 * np.eye(6)
        numeric = (objective.values(q + steps) - objective.values(q - steps)) / 2e-5
        # Central differences: h² times third derivatives, and rounding of E over 2h.
        np.testing.assert_allclose(gradient, numeric, rtol=1e-5, atol=1e-9 * E)


def test_residuals_square_to_the_value(problem):
    objective = NumpyObjective(problem[1], 0)
    for q in points(problem[1], 5):
        r, jacobian = objective.residuals(q)
        E, gradient = objective.value_and_gradient(q)
        assert r @ r == pytest.approx(E, rel=1e-14)
        np.testing.assert_allclose(2 * r @ jacobian, gradient, rtol=1e-12)


def test_masked_values_are_left_out(small_scan, device):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[3:9, 0] = 1 << 4
    spoiled = small_scan.brdf.copy()
    spoiled[3:9, 0] = 1e6
    scan = replace(small_scan, brdf=spoiled, flags=flags)
    p = make_problem(scan, weight_matrix(scan), MODEL, MODEL.bounds(), device)
    objective = NumpyObjective(p, 0)
    assert len(objective.target) == len(small_scan.theta_i) - 6
    truth = np.array(naive.TIN_FOIL)
    truth[[4, 5]] *= 0.9
    assert objective.at_parameters(truth) < 1e-20


def test_what_is_not_finite_is_huge(problem):
    objective = NumpyObjective(problem[1], 0)
    q = np.array([20.0, -1.0, -30.0, 1.0, 1024.0, 0.0])  # ks = 2^1024 overflows
    assert objective.values(q[None])[0] == HUGE
    E, gradient = objective.value_and_gradient(q)
    assert E == HUGE
    assert (gradient == 0.0).all()


def test_a_model_without_linear_parameters_is_served_too(problem):
    rows = tuple(replace(row, linear=False) for row in MODEL.parameters)
    bare = replace(MODEL, structure=None, parameters=rows, homogeneous=False)
    plain = NumpyObjective(replace(problem[1], model=bare), 1)
    for q in points(problem[1], 3):
        E, gradient = plain.value_and_gradient(q)
        expected, slope = NumpyObjective(problem[1], 1).value_and_gradient(q)
        assert pytest.approx(expected, rel=1e-12) == E
        np.testing.assert_allclose(gradient, slope, rtol=1e-9)
    with pytest.raises(InputError, match="has no linear parameters"):
        SeparableObjective(plain)
    found = search_twice(plain, effort=0.01)
    assert [f.optimizer for f in found] == ["least-squares", "evolution"]
    assert all(np.isfinite(f.objective) for f in found)


def test_the_separable_objective_is_the_minimum_over_ks_and_kd(problem):
    objective = NumpyObjective(problem[1], 2)
    separable = SeparableObjective(objective)
    for q in points(problem[1], 10)[:, :4]:
        E = separable.values(q[None])[0]
        whole = separable.complete(q)
        assert objective.values(whole[None])[0] == pytest.approx(E, rel=1e-10)
        one = MODEL.from_coordinates(np.append(q, [0.0, 0.0]))
        columns = []
        for unit in ([1.0, 0.0], [0.0, 1.0]):
            one[4:] = unit
            columns.append(objective.scale * objective.seen.brdf(one[None, :]))
        best = lsq_linear(
            np.array(columns).T, objective.target, bounds=([1e-12, 1e-12], [1e5, 10.0]), tol=1e-14
        )
        # lsq_linear stops a little inside of its limits.
        assert 2.0 * best.cost * (1 + 1e-12) >= E
        assert pytest.approx(2.0 * best.cost, rel=1e-6) == E


@pytest.mark.parametrize("seed", range(6))
def test_least_squares_in_a_box_meet_scipy(seed):
    rng = np.random.default_rng(seed)
    basis, target = rng.standard_normal((4, 2, 30)), rng.standard_normal(30)
    limits = np.sort(rng.uniform(-0.3, 0.3, (2, 2)), axis=0)
    found = box_least_squares(basis, target, limits)
    for B, p in zip(basis, found, strict=True):
        expected = lsq_linear(B.T, target, bounds=tuple(limits), method="bvls", tol=1e-14).x
        np.testing.assert_allclose(p, expected, atol=1e-9)


def test_empty_bases_get_their_lower_limit():
    basis = np.zeros((1, 2, 5))
    basis[0, 1] = 1.0
    found = box_least_squares(basis, np.full(5, 3.0), np.array([[1e-12, 1e-12], [1e5, 10.0]]))
    np.testing.assert_allclose(found, [[1e-12, 3.0]], rtol=1e-12)

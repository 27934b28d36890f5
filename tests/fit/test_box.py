"""Linear parameters within their limits: NumPy and OpenCL against SciPy's bounded least squares."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from clbrdf import Scan
from clbrdf.fit.box import box_minimum
from clbrdf.fit.problem import make_problem
from clbrdf.fit.thin import thinned
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix

lookup = importlib.import_module("clbrdf.fit.lookup")


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("seed", range(4))
def test_box_minimum_meets_scipy(count, seed):
    rng = np.random.default_rng([seed, count])
    basis = rng.standard_normal((40, count))
    basis[:, -1] += 2.0 * basis[:, 0]  # columns that lean on each other
    basis /= np.linalg.norm(basis, axis=0)
    target = rng.standard_normal(40)
    low, high = -rng.uniform(0.0, 0.4, count), rng.uniform(0.0, 0.4, count)
    x, value = box_minimum(
        (basis.T @ basis)[..., None], -(basis.T @ target)[:, None], low[:, None], high[:, None]
    )
    found = lsq_linear(basis, target, bounds=(low, high), method="bvls", tol=1e-14)
    expected = 2.0 * found.cost - target @ target
    # The second solve finds the active set in all but degenerate cases: 1e-9 of the sum is left for those.
    assert value[0] <= expected + 1e-9 * abs(expected)
    assert ((x[:, 0] >= low) & (x[:, 0] <= high)).all()


def test_what_has_overflowed_stays_where_it_is():
    x, value = box_minimum(
        np.full((1, 1, 1), 1.0), np.array([[np.inf]]), np.array([[-1.0]]), np.array([[1.0]])
    )
    assert x.tolist() == [[0.0]]
    assert value.tolist() == [0.0]


def scan_of(name, seed=0):
    model, rng = get_model(name), np.random.default_rng(seed)
    theta_i = np.repeat([20.0, 50.0, 70.0], 30)
    theta_r = np.tile(np.linspace(0.0, 80.0, 30), 3)
    empty = Scan(theta_i, 0.0, theta_r, 180.0, [550.0], np.ones((90, 1)))
    exact = model.brdf(model.defaults[None], model.features(empty.directions))
    noisy = exact * (1.0 + 0.05 * rng.standard_normal(90))
    return Scan(theta_i, 0.0, theta_r, 180.0, [550.0], noisy[:, None], sigma=0.05 * np.abs(exact)[:, None])


@pytest.mark.parametrize("name", ["ggx+lambert", "ggx+ggx+lambert", "ross_li", "abg+abg+lambert"])
def test_the_look_up_solves_linear_parameters_as_scipy_does(name, device):
    model, scan = get_model(name), scan_of(name)
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    shapes = lookup.shape_set(problem, 64)[:40]
    energy, solved = lookup.look_up(problem, shapes)
    limits = model.bounds()[list(model.linear)].T
    for k, q in enumerate(shapes):
        p = model.from_coordinates(q)
        p[list(model.linear)] = 1.0
        basis = model.jacobian(p[None], problem.features)[:, list(model.linear)] * problem.scale[0][:, None]
        found = lsq_linear(basis, problem.target[0], bounds=tuple(limits), method="bvls", tol=1e-14)
        # In single precision terms that lean on each other to within 1e-5 are not solved apart: what is
        # found may lie above the minimum, which a look-up that ranks shapes can bear, but never below.
        assert -1e-3 <= energy[0, k] - np.log2(2.0 * found.cost) <= 0.4
    assert solved.shape == (1, len(shapes), len(model.linear))


def test_a_thinned_problem_keeps_the_mirror_direction_and_the_sum(device):
    model, scan = get_model("ggx+lambert"), scan_of("ggx+lambert")
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    few = thinned(problem, 30)
    assert few.size == (1, 30)
    assert few.mirror.min() == problem.mirror.min()
    assert few.starts[-1] == 30
    assert thinned(problem, 90) is problem
    # Directions that stand for others weigh as much as those: all weights squared add up to N.
    plain = problem.scale[0][0]
    assert np.sum((few.scale[0] / plain) ** 2) == pytest.approx(90.0, rel=1e-9)

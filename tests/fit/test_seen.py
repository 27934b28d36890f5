"""Kernels and NumPy agree on what the detector sees, and the polish ends where SciPy ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from clbrdf import Directions, Scan
from clbrdf.fit.objectives import batch_objective
from clbrdf.fit.polish import MOST_ITERATIONS, TOLERANCE, descend
from clbrdf.fit.problem import make_problem
from clbrdf.fit.seen import BEAMS, NODES, POINTS, library_of
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.observation import Observation
from clbrdf.opencl.precision import get_precision
from clbrdf.optimizers.device_objective import DeviceObjective
from clbrdf.optimizers.objective import NumpyObjective

DOUBLE = get_precision("double")


def observation_of(kind, directions, seed=3):
    """Points; nodes about the view direction; or about both: two to five a direction, of random weights."""
    if kind == POINTS:
        return Observation.points(directions)
    rng = np.random.default_rng(seed)
    owner = np.repeat(np.arange(len(directions)), rng.integers(2, 6, len(directions)))
    d, k = directions[owner], len(owner)
    theta_i = d.theta_i + (rng.normal(0.0, 1.0, k).round() if kind == BEAMS else 0.0)
    nodes = Directions(
        theta_i, d.phi_i, np.abs(d.theta_r + rng.normal(0.0, 1.0, k)), d.phi_r + rng.normal(0, 2, k)
    )
    return Observation(nodes, owner, rng.uniform(0.1, 0.5, k))


def problem_of(model, kind, device):
    """Two wavelengths of model values with some noise, as seen through the observation."""
    rng = np.random.default_rng(4)
    theta_i = np.repeat([20.0, 40.0, 60.0], 30)
    directions = Directions.relative(theta_i, np.tile(np.linspace(1.0, 75.0, 30), 3), 180.0)
    observation = observation_of(kind, directions)
    weight = np.zeros((len(directions), len(observation.nodes)))
    weight[observation.owner, np.arange(len(observation.nodes))] = observation.weight
    values = weight @ model.brdf(model.defaults[None, :], model.features(observation.nodes))
    noisy = values[:, None] * rng.normal(1.0, 0.01, (len(values), 2))
    scan = Scan(theta_i, 0.0, directions.theta_r, directions.phi_r, [500.0, 600.0], noisy)
    problem = make_problem(
        *(scan, weight_matrix(scan, "relative"), model, model.bounds(), device), observation=observation
    )
    assert library_of(problem.seen) == kind
    return problem


@pytest.mark.parametrize("kind", [POINTS, NODES, BEAMS])
@pytest.mark.parametrize("name", ["ggx+lambert", "wang2013"])
def test_the_polish_ends_where_scipy_ends(name, kind, device):
    model = get_model(name)
    problem = problem_of(model, kind, device)
    rng = np.random.default_rng(5)
    truth = model.to_coordinates(model.defaults)
    starts = truth + rng.normal(0.0, 0.02, (2, 3, len(truth)))
    starts = np.clip(starts, problem.lower[:, None], problem.upper[:, None])
    ends = descend(problem, starts, DOUBLE, MOST_ITERATIONS, TOLERANCE)
    assert ends.converged.all()
    for w in range(2):
        objective = NumpyObjective(problem, w)
        free = objective.coordinates.free
        end = least_squares(
            lambda q, objective=objective: objective.residuals(q)[0],
            np.clip(starts[w, 0][free], objective.lower + 1e-9, objective.upper - 1e-9),
            bounds=(objective.lower, objective.upper),
            x_scale="jac",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        # SciPy's derivatives are differences: its E ends 1e-10 above the minimum.
        np.testing.assert_allclose(ends.objective[w], 2.0 * end.cost, rtol=1e-8)


@pytest.mark.parametrize("kind", [POINTS, NODES, BEAMS])
def test_kernels_and_numpy_agree(kind, device):
    model = get_model("ggx+lambert")
    problem = problem_of(model, kind, device)
    rng = np.random.default_rng(6)
    q = problem.lower[0] + (problem.upper - problem.lower)[0] * rng.uniform(
        0.3, 0.7, (5, problem.lower.shape[1])
    )
    host, there = NumpyObjective(problem), DeviceObjective(problem)
    energies = host.values(q)
    # Sums of some hundred terms, all positive.
    np.testing.assert_allclose(there.values(q), energies, rtol=1e-12)
    sets = np.broadcast_to(model.from_coordinates(q), (2, *q.shape))
    np.testing.assert_allclose(batch_objective(problem, sets, DOUBLE)[0], energies, rtol=1e-12)
    for one in q:
        E, gradient = there.value_and_gradient(one)
        E_host, gradient_host = host.value_and_gradient(one)
        assert pytest.approx(E_host, rel=1e-12) == E
        np.testing.assert_allclose(
            gradient, gradient_host, rtol=1e-9, atol=1e-11 * np.abs(gradient_host).max()
        )


@pytest.mark.parametrize("kind", [NODES, BEAMS])
def test_lanes_of_wavelengths_end_where_lanes_of_starts_do(kind, device):
    """One start takes vectors of wavelengths, several take vectors of starts: the same arithmetic."""
    model = get_model("ggx+lambert")
    problem = problem_of(model, kind, device)
    starts = np.clip(model.to_coordinates(model.defaults) + 0.01, problem.lower, problem.upper)[:, None]
    across = descend(problem, starts, DOUBLE, MOST_ITERATIONS, TOLERANCE)
    along = descend(problem, np.repeat(starts, 2, axis=1), DOUBLE, MOST_ITERATIONS, TOLERANCE)
    assert across.converged.all()
    # Both stop where a step would lower E by less than 1e-14.
    np.testing.assert_allclose(across.objective[:, 0], along.objective[:, 1], rtol=1e-12)
    np.testing.assert_allclose(across.coordinates[:, 0], along.coordinates[:, 1], rtol=1e-6)
    half = np.array([[True], [False]])
    ends = descend(problem, starts, DOUBLE, MOST_ITERATIONS, TOLERANCE, half)
    np.testing.assert_array_equal(ends.coordinates[0], starts[0])
    np.testing.assert_array_equal(ends.coordinates[1], across.coordinates[1])

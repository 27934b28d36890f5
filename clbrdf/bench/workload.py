"""The work that throughput is measured on: E of many parameter sets over the paper's kind of scan."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from clbrdf.fit.objectives import prepare_objective
from clbrdf.fit.problem import Problem, make_problem
from clbrdf.geometry import Directions
from clbrdf.models import Model, get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.device import Device
from clbrdf.opencl.lanes import Lanes
from clbrdf.opencl.precision import Precision
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

INCIDENT = (75.0, 70.0, 65.0, 60.0, 50.0, 45.0, 40.0, 30.0, 15.0)
"""Falling, as problems order their groups: by the cosine."""

VIEW_COUNT = 86
SETS = 8192


def workload_directions() -> Directions:
    """Return the 774 directions of the workload."""
    theta_r = np.tile(np.arange(float(VIEW_COUNT)), len(INCIDENT))
    return Directions.relative(np.repeat(INCIDENT, VIEW_COUNT), theta_r, np.full(1, 180.0))


def workload(device: Device, sets: int = SETS, model: Model | None = None) -> tuple[Problem, Array]:
    """Return one wavelength × 774 directions, and parameter sets (1, sets, P) near its optimum."""
    model, rng = model or get_model(), np.random.default_rng(2013)
    directions = workload_directions()
    theta_i, theta_r = directions.theta_i, directions.theta_r
    centre = model.defaults
    truth = model.brdf(centre[None, :], model.features(directions))
    noisy = truth * (1.0 + 0.06 * rng.standard_normal(len(truth)))
    phi_r = np.full(1, 180.0)
    scan = Scan(theta_i, np.zeros(1), theta_r, phi_r, np.full(1, 550.0), np.abs(noisy)[:, None])
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    return problem, (centre * (1.0 + 0.01 * rng.standard_normal((sets, len(centre)))))[None]


def median_seconds(run: Callable[[], object], repeats: int = 7) -> float:
    """Return the median wall time of a function over some runs, after one that does not count."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def objective_rate(device: Device, precision: Precision, lanes: Lanes) -> float:
    """Return million model evaluations a second in E of the workload."""
    problem, sets = workload(device)
    launch, _ = prepare_objective(problem, sets, precision, lanes)
    rate: float = problem.size[1] * sets.shape[1] / median_seconds(launch) / 1e6
    return rate

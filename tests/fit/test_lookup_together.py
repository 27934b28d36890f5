"""Shapes of models without linear parameters are looked up for several wavelengths at once."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.fit.problem import make_problem
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix

lookup = importlib.import_module("clbrdf.fit.lookup")


@pytest.mark.parametrize("wavelengths", [1, 8, 19])  # a part of a work item's, all, and some of a third's
@pytest.mark.parametrize("name", ["hapke", "eon"])
def test_the_objective_is_that_of_numpy_at_every_wavelength(name, wavelengths, device):
    model, rng = get_model(name), np.random.default_rng(wavelengths)
    theta_i = np.repeat([20.0, 50.0], 37)
    theta_r = np.tile(np.linspace(0.0, 80.0, 37), 2)
    brdf = rng.uniform(0.05, 0.4, (74, wavelengths))
    brdf[rng.uniform(size=brdf.shape) < 0.1] = np.nan
    scan = Scan(theta_i, 0.0, theta_r, 180.0, 400.0 + np.arange(wavelengths), brdf)
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device)
    shapes = lookup.shape_set(problem, 64)[:37]
    energy, linear = lookup.look_up(problem, shapes)
    f = model.brdf(model.from_coordinates(shapes)[:, None], problem.features)
    expected = [((problem.scale[w] * f - problem.target[w]) ** 2).sum(axis=1) for w in range(wavelengths)]
    # The bound of fast:6 on values near the data, 74 residuals that partly cancel: some 1e-5 in E.
    np.testing.assert_allclose(energy, np.log2(expected), atol=1e-4)
    assert linear.shape == (wavelengths, len(shapes), 0)


def test_limits_that_differ_from_wavelength_to_wavelength_are_kept(device):
    """A parameter that is told with a spectrum has a value of its own at every wavelength."""
    model = get_model("eon")
    theta_r = np.linspace(0.0, 80.0, 30)
    scan = Scan(30.0, 0.0, theta_r, 180.0, [400.0, 500.0, 600.0], np.full((30, 3), 0.2))
    told = np.array([0.2, 0.5, 0.9])
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device, {"rho": told})
    shapes = lookup.shape_set(problem, 1024)
    energy, _ = lookup.look_up(problem, shapes)
    expected = []
    for w, rho in enumerate(told):
        p = model.from_coordinates(shapes)
        p[:, model.names.index("rho")] = rho
        f = model.brdf(p[:, None], problem.features)
        expected.append(((problem.scale[w] * f - problem.target[w]) ** 2).sum(axis=1))
    np.testing.assert_allclose(energy, np.log2(expected), atol=1e-4)

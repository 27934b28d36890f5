"""Spectral smoothness: the minimum of the documented sum, its uncertainties, and neighbours that help."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import clbrdf
from clbrdf import InputError, Scan
from clbrdf.fit.problem import make_problem
from clbrdf.fit.smooth import smooth, start_each_other
from clbrdf.fit.solve import Solution
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from tests.reference import naive

MODEL = get_model()
WAVELENGTH = np.array([500.0, 510.0, 515.0, 540.0])


@pytest.fixture
def scan():
    theta_i, theta_r = np.repeat([30.0, 45.0, 60.0], 29), np.tile(np.arange(0.0, 85.0, 3.0), 3)
    sets = [(3.87, 0.52, -300.0 + k, 0.74, 450.0, 1.3) for k in range(4)]
    columns = [naive.brdf(p, theta_i, theta_r, 180.0) for p in sets]
    truth = np.stack(columns, axis=1)
    noise = np.random.default_rng(51).standard_normal(truth.shape)
    return Scan(theta_i, 0.0, theta_r, 180.0, WAVELENGTH, truth * (1.0 + 0.05 * noise))


def solution_of(problem, fit):
    w = len(fit.wavelength)
    counts = np.zeros(w, np.int64)
    q = MODEL.to_coordinates(fit.vector)
    return Solution(
        q, fit.objective, np.ones(w, bool), counts, counts, counts, counts, np.zeros(w), np.zeros(w, bool)
    )


def residuals_of_phi(problem, noise, change):
    """Φ as a plain sum of squares, written from its definition."""

    def residuals(flat):
        q = flat.reshape(len(WAVELENGTH), 6)
        values = MODEL.brdf(MODEL.from_coordinates(q)[:, None, :], problem.features)
        data = (problem.scale * values - problem.target) / np.sqrt(noise)[:, None]
        steps = np.diff(q, axis=0) / (change * (problem.upper - problem.lower)[0])
        return np.concatenate([data.ravel(), (steps / np.sqrt(np.diff(WAVELENGTH) / 10.0)[:, None]).ravel()])

    return residuals


@pytest.mark.parametrize("change", [0.1, 0.01, 0.001])
def test_minimum_and_uncertainties_are_those_of_a_plain_least_squares(scan, device, change):
    fit = clbrdf.fit(scan, weights="relative")
    problem = make_problem(scan, weight_matrix(scan, "relative"), MODEL, MODEL.bounds(), device)
    start = solution_of(problem, fit)
    ends, tied = smooth(problem, start, WAVELENGTH, change)
    noise = fit.objective / (len(scan.theta_i) - 6)
    residuals = residuals_of_phi(problem, noise, change)
    bounds = (problem.lower.ravel(), problem.upper.ravel())
    options = {"x_scale": "jac", "xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    end = least_squares(residuals, start.coordinates.ravel(), bounds=bounds, **options)
    assert (residuals(ends.coordinates.ravel()) ** 2).sum() <= 2.0 * end.cost * (1.0 + 1e-8)
    # SciPy's derivatives are differences, good to about 1e-6 relative.
    expected = np.linalg.inv(end.jac.T @ end.jac)
    for w in range(4):
        block = expected[6 * w : 6 * w + 6, 6 * w : 6 * w + 6]
        scale = np.sqrt(np.outer(np.diag(block), np.diag(block)))
        np.testing.assert_allclose(tied.covariance[w] / scale, block / scale, atol=1e-3)


def test_a_penalty_brings_neighbours_together_and_narrows_error_bars(scan):
    rough, even = clbrdf.fit(scan, weights="relative"), clbrdf.fit(scan, weights="relative", smooth=0.001)
    for name in MODEL.names:
        assert np.ptp(even.parameters[name]) < np.ptp(rough.parameters[name])
        assert (even.sigma[name] < rough.sigma[name]).all()
    assert (even.objective >= rough.objective * (1.0 - 1e-9)).all()
    assert even.setup.smooth == 0.001
    assert rough.setup.smooth is None


def test_neighbours_lead_out_of_a_bad_optimum(scan, device):
    fit = clbrdf.fit(scan)
    problem = make_problem(scan, weight_matrix(scan), MODEL, MODEL.bounds(), device)
    good = solution_of(problem, fit)
    q, energy = good.coordinates.copy(), good.objective.copy()
    q[2] = [0.0, 0.5, 2.0, 1.0, -20.0, 0.0]
    energy[2] = 0.9
    mended = start_each_other(problem, replace(good, coordinates=q, objective=energy))
    np.testing.assert_allclose(mended.objective, good.objective, rtol=1e-9)


def test_one_wavelength_has_no_neighbours(scan):
    one = scan.columns([0])
    np.testing.assert_allclose(clbrdf.fit(one, smooth=0.01).objective, clbrdf.fit(one).objective, rtol=1e-9)


@pytest.mark.parametrize("change", [0.0, -1.0, 1e-5, 2.0, float("nan"), "x"])
def test_the_share_is_checked(scan, change):
    with pytest.raises(InputError, match=r"smooth is .*; give 0\.0001 to 1"):
        clbrdf.fit(scan, smooth=change)


def test_what_nothing_determines_stays_and_has_a_wide_error_bar(scan):
    """One wavelength, or two incident angles: directions that neither data nor neighbours feel."""
    two = replace(scan.columns([0, 1]), flags=np.zeros((len(scan.theta_i), 2), np.uint32))
    flags = two.flags.copy()
    flags[two.theta_i == 60.0] = 1
    for poor in (replace(two, flags=flags), replace(two, flags=flags).columns([0])):
        fit = clbrdf.fit(poor, weights="relative", smooth=0.01)
        assert np.isfinite(fit.vector).all()
        assert not np.isnan(fit.sigma["ks"]).any()
        assert set(fit.status.tolist()) <= {"ambiguous", "not converged", "at bound"}


def test_constant_data_have_no_lobe_and_can_be_smoothed():
    angles = np.arange(0.0, 80.0, 5.0)
    flat = Scan(np.full(16, 30.0), 0.0, angles, 180.0, [500.0, 550.0], np.full((16, 2), 0.3))
    fit = clbrdf.fit(flat, smooth=0.01)
    np.testing.assert_allclose(fit.evaluate(), 0.3, rtol=1e-6)

"""Draws fitted again: where they agree with the linear propagation, where they have to differ."""

import numpy as np
import pytest

import clbrdf
from clbrdf.errors import InputError
from clbrdf.fit.montecarlo import _Errors, shortest
from clbrdf.fit.problem import make_problem
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.scan import Component, Correlation
from tests.fit.test_carried import MODEL, made
from tests.test_components import covariance, make_components

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")
NOISE = Component("noise", 0.005, True, RANDOM, SYSTEMATIC, RANDOM)


def test_shortest_interval_of_an_exponential_begins_at_zero():
    draws = -np.log1p(-((np.arange(20_000) + 0.5) / 20_000))[None, :, None]
    low, high = shortest(np.random.default_rng(0).permutation(draws, axis=1), 0.95)
    assert low[0, 0] == pytest.approx(0.0, abs=1e-4)
    assert high[0, 0] == pytest.approx(-np.log(0.05), rel=1e-3)


@pytest.mark.parametrize("seed", [0, 3])
def test_draws_have_the_covariance_of_the_components(device, seed):
    components = (NOISE, *make_components(12, 3, seed))
    scan = made(components, seed=seed)
    g = weight_matrix(scan, "sigma")
    problem = make_problem(scan, g, MODEL, MODEL.bounds(), device)
    values = scan.brdf.T[:, problem.order]
    errors = _Errors.of(scan, problem, g, values, 20_000, 1)
    back = np.argsort(problem.order)
    drawn = np.stack([errors.draw(k)[:, back] for k in range(3)], axis=2).reshape(20_000, 36)
    expected = sum(covariance(scan, one) for one in scan.components)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # An entry of a sample covariance of K draws scatters by at most √2/√K of its scale: 0.01, five of them.
    np.testing.assert_allclose((drawn.T @ drawn / 20_000) / scale, expected / scale, atol=0.05)


def test_draws_agree_with_the_linear_propagation_far_from_limits(tmp_path):
    scan = made((NOISE, Component("panel", 0.02)), w=3)
    fit = clbrdf.fit(scan, model=MODEL, weights="sigma", monte_carlo=1000, seed=4)
    told = fit.monte_carlo
    assert not told.departs.any()
    assert (told.converged == 1.0).all()
    sigma = fit.estimate.sigma
    for (low, high), reach in zip(told.intervals, (1.0, 1.96), strict=True):
        # Half an interval of 1000 draws scatters by 3 %: four of them.
        np.testing.assert_allclose((high - low) / 2.0, reach * sigma, rtol=0.12)
    fit.save(tmp_path / "fit.h5")
    again = clbrdf.Fit.open(tmp_path / "fit.h5").monte_carlo
    assert again.intervals.tobytes() == told.intervals.tobytes()
    assert (again.draws, again.seed) == (1000, 4)
    same = clbrdf.fit(scan.columns([2]), model=MODEL, weights="sigma", monte_carlo=1000, seed=4)
    # A wavelength draws the same whatever else is in the scan; the polish stops at 1e-7 of E.
    np.testing.assert_allclose(same.monte_carlo.intervals[:, :, 0], told.intervals[:, :, 2], rtol=1e-6)


def test_a_parameter_near_its_bound_has_an_interval_that_ends_there():
    truth = {"ward.rho_s": 0.3, "ward.alpha": 0.25, "lambert.rho": 0.0004}
    scan = made((Component("noise", 0.0005, False, RANDOM, SYSTEMATIC, RANDOM),), truth=truth)
    fit = clbrdf.fit(scan, model=MODEL, weights="sigma", monte_carlo=1000)
    j = MODEL.names.index("lambert.rho")
    told = fit.monte_carlo
    low, high = told.intervals[1]
    assert (fit.vector[:, j] - 1.96 * fit.estimate.sigma[:, j] < 0.0).all(), (
        "the linear interval leaves the range"
    )
    assert (low[:, j] == 0.0).all()
    assert (high[:, j] > fit.vector[:, j]).all()
    assert told.departs[:, j].all()
    assert (told.at_bound[:, j] > 0.05).all()


def test_a_weak_lobe_has_a_width_that_is_not_normal():
    truth = {"ward.rho_s": 0.002, "ward.alpha": 0.25, "lambert.rho": 0.4}
    scan = made((Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM),), w=1, truth=truth)
    fit = clbrdf.fit(scan, model=MODEL, weights="sigma", monte_carlo=500)
    assert fit.monte_carlo.departs[0, MODEL.names.index("ward.alpha")]


def test_without_uncertainties_the_residuals_are_drawn():
    fit = clbrdf.fit(made((), noise=0.01), model=MODEL, weights="relative", monte_carlo=400)
    low, high = fit.monte_carlo.intervals[0]
    np.testing.assert_allclose((high - low) / 2.0, fit.estimate.sigma, rtol=0.2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"monte_carlo": 10}, "100 to 100000"),
        ({"monte_carlo": 1000, "shared": ("ward.alpha",)}, "every wavelength by itself"),
        ({"monte_carlo": 1000, "smooth": 0.01}, "every wavelength by itself"),
    ],
)
def test_draws_that_cannot_be_made_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        clbrdf.fit(made((NOISE,)), model=get_model("ward+lambert"), weights="sigma", **options)

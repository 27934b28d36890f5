"""Uncertainties against SciPy, and against what repeated noise does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import curve_fit

import clbrdf
from clbrdf import Scan
from clbrdf.fit import AnnealSettings
from tests.reference import naive

SHORT = AnnealSettings(chains=32, levels=15, starts=8)


@pytest.fixture
def noisy(small_scan):
    noise = np.random.default_rng(4).standard_normal(small_scan.brdf.shape)
    return replace(small_scan, brdf=small_scan.brdf * (1.0 + 0.05 * noise))


@pytest.mark.parametrize("weights", ["sigma", "none"])
def test_uncertainties_are_those_of_scipy(noisy, weights):
    scan = noisy if weights == "sigma" else replace(noisy, sigma=None)
    fit = clbrdf.fit(scan, weights=weights, settings=SHORT)

    def model(_, *parameters):
        return naive.brdf(parameters, scan.theta_i, scan.theta_r, scan.phi)

    for k in range(3):
        sigma = None if scan.sigma is None else scan.sigma[:, k]
        values = scan.brdf[:, k]
        _, covariance = curve_fit(
            model, np.arange(48), values, p0=fit.vector[k], sigma=sigma, absolute_sigma=sigma is not None
        )
        ours = [fit.sigma[name][k] for name in fit.model.names]
        # SciPy's derivatives are differences: good to about 1e-4 of the covariance here.
        np.testing.assert_allclose(ours, np.sqrt(np.diag(covariance)), rtol=1e-3)


@pytest.mark.parametrize("known", [True, False], ids=["noise known", "from the residuals"])
@pytest.mark.parametrize("parameters", [naive.TIN_FOIL, naive.CERAMIC_TILE], ids=["tin foil", "tile"])
def test_true_parameters_lie_within_the_error_bars_as_often_as_they_should(parameters, known):
    """1000 fits of one truth with relative noise: 68.3 % of pulls below 1."""
    theta_i, theta_r = np.repeat([30.0, 45.0, 60.0], 43), np.tile(np.arange(0.0, 86.0, 2.0), 3)
    truth = naive.brdf(parameters, theta_i, theta_r, 180.0)[:, None] * np.ones(1000)
    noise = np.random.default_rng(6).standard_normal(truth.shape)
    scan = Scan(
        theta_i,
        0.0,
        theta_r,
        180.0,
        np.arange(400.0, 1400.0),
        truth * (1.0 + 0.02 * noise),
        sigma=0.02 * truth if known else None,
    )
    fit = clbrdf.fit(scan, weights="sigma" if known else "relative")
    for name, value in zip(fit.model.names, parameters, strict=True):
        share = np.mean(np.abs(fit.parameters[name] - value) < fit.sigma[name])
        # Binomial standard deviation of 1000 draws is 1.5 %.
        assert share == pytest.approx(0.683, abs=0.05), name

"""Whether a model describes the data: figures by hand, silence on noise, and a word where it does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import clbrdf
from clbrdf import Scan
from clbrdf.bench import coverage
from clbrdf.fit.goodness import DOUBT
from clbrdf.fit.tables import concise
from clbrdf.fit.words import remarks_line
from clbrdf.models import get_model

NOISE = 0.02


def scan_of(values, phi_i=0.0, sigma=NOISE, seed=3, wavelengths=100):
    """Scans of three incident angles; `values` (θi, θr, φi in degrees) are BRDFs, relative noise on them."""
    theta_r = np.arange(0.0, 81.0, 5.0)
    theta_i, theta_r, phi_i = (
        axis.ravel() for axis in np.meshgrid([20.0, 40.0, 60.0], theta_r, np.atleast_1d(phi_i), indexing="ij")
    )
    truth = values(theta_i, theta_r, phi_i)[:, None] * np.ones(wavelengths)
    draws = np.random.default_rng(seed).standard_normal(truth.shape)
    nm = 400.0 + np.arange(wavelengths)
    measured = truth * (1.0 + NOISE * draws)
    return Scan(
        theta_i, phi_i, theta_r, phi_i + 180.0, nm, measured, None if sigma is None else sigma * truth
    )


def lambert(theta_i, theta_r, phi_i):
    return 0.1 + 0.0 * (theta_i + theta_r + phi_i)


def lobed(theta_i, theta_r, phi_i):
    return 0.1 + 0.02 * np.exp(-(((theta_r - theta_i) / 15.0) ** 2)) + 0.0 * phi_i


def turning(theta_i, theta_r, phi_i):
    return (0.1 + 0.0 * theta_i) * (1.0 + 0.2 * np.cos(2.0 * np.deg2rad(phi_i)) * np.sin(np.deg2rad(theta_r)))


def kinds(fit):
    return {remark.kind for remarks in fit.remarks for remark in remarks}


def test_chi2_is_that_of_the_definition():
    scan = scan_of(lobed, wavelengths=3)
    fit = clbrdf.fit(scan, model="lambert", weights="sigma")
    by_hand = (((scan.brdf - fit.parameters["rho"] / np.pi) / scan.sigma) ** 2).sum(axis=0)
    np.testing.assert_allclose(fit.chi2_reduced, by_hand / (len(scan) - 1), rtol=1e-12)
    np.testing.assert_allclose(fit.goodness.scatter**2, fit.chi2_reduced, rtol=1e-12)
    np.testing.assert_allclose(fit.residuals, scan.brdf - fit.evaluate(), rtol=0, atol=0)


def test_an_uncertainty_of_next_to_nothing_makes_chi2_infinite_without_a_warning():
    scan = scan_of(lambert, wavelengths=2)
    sigma = scan.sigma.copy()
    sigma[3, 0] = 5e-324
    fit = clbrdf.fit(replace(scan, sigma=sigma), model="lambert", weights="none")
    assert fit.chi2_reduced[0] == np.inf
    assert list(fit.misfit) == [True, False]


@pytest.mark.parametrize("weights", ["none", "relative", "sigma"])
def test_noise_alone_is_not_remarked(weights):
    fit = clbrdf.fit(scan_of(lambert), model="lambert", weights=weights)
    assert not fit.misfit.any()
    assert not kinds(fit)
    # Of 100 χ²/ν with ν = 50 their mean has a standard error of 0.02.
    assert fit.chi2_reduced.mean() == pytest.approx(1.0, abs=0.08)
    assert abs(fit.goodness.lag_one.mean()) < 0.08


def test_a_model_that_misses_is_said_to():
    fit = clbrdf.fit(scan_of(lobed), model="lambert", weights="sigma")
    assert fit.misfit.all()
    assert {"misfit", "neighbours"} <= kinds(fit)
    assert "the model does not describe the data within their uncertainties" in remarks_line(fit.remarks[0])
    assert "misfit" in fit.report()
    assert "not described at 100 of 100 wavelengths" in fit.report()


def test_weights_are_blamed_before_the_model():
    fit = clbrdf.fit(scan_of(lobed), model="lambert", weights="none")
    assert "other weights" in kinds(fit)
    assert "misfit" not in kinds(fit)
    assert "a fit with weights sigma shows whether the model can" in remarks_line(fit.remarks[0])


def test_uncertainties_that_are_too_large_are_said_to_be():
    assert kinds(clbrdf.fit(scan_of(lambert, sigma=5 * NOISE), model="lambert", weights="sigma")) == {
        "overstated"
    }


def test_lack_of_fit_is_the_f_test():
    once = scan_of(lobed, sigma=None, wavelengths=4)
    again = replace(scan_of(lobed, sigma=None, wavelengths=4, seed=4))
    scan = Scan.merge([once, again])
    fit = clbrdf.fit(scan, model="lambert")
    assert (fit.goodness.repeats == len(once)).all()
    for k in range(4):
        pair = np.stack([once.brdf[:, k], again.brdf[:, k]])
        pure = ((pair - pair.mean(axis=0)) ** 2).sum()
        total = ((pair - fit.parameters["rho"][k] / np.pi) ** 2).sum()
        n = len(once)
        F = ((total - pure) / (2 * n - 1 - n)) / (pure / n)
        assert fit.goodness.lack_of_fit[k] == pytest.approx(F, rel=1e-9)
        assert fit.misfit[k] == (stats.f.sf(F, n - 1, n) < DOUBT)
    assert "times the scatter of repeats" in fit.report()


def test_data_that_change_with_the_incident_azimuth():
    phi_i = np.arange(0.0, 180.0, 30.0)
    fit = clbrdf.fit(scan_of(turning, phi_i, wavelengths=5), model="lambert", weights="relative")
    assert "azimuth" in kinds(fit)
    assert "take an anisotropic one" in remarks_line(fit.remarks[0])
    assert "azimuth" not in kinds(clbrdf.fit(scan_of(lambert, phi_i), model="lambert", weights="relative"))


def test_values_without_a_weight_are_counted():
    scan = scan_of(lambert, wavelengths=3)
    sigma = np.array(scan.sigma)
    sigma[:, 0], sigma[:7, 1], sigma[:3, 2] = np.nan, np.nan, 0.0
    fit = clbrdf.fit(replace(scan, sigma=sigma), model="lambert", weights="sigma")
    assert fit.status.tolist() == ["no weight", "converged", "converged"]
    told = [{r.kind: r.numbers[0] for r in remarks} for remarks in fit.remarks]
    assert told == [{"without sigma": len(scan)}, {"without sigma": 7.0}, {"sigma of 0": 3.0}]


def test_exact_data_are_no_misfit():
    scan = scan_of(lambert, wavelengths=2)
    exact = replace(scan, brdf=np.full(scan.brdf.shape, 0.1), sigma=None)
    fit = clbrdf.fit(exact, model="lambert")
    assert not fit.misfit.any()
    assert not kinds(fit)


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (0.0256204, 1.36e-5, "0.025620(14)"),
        (-10.8994, 0.0663, "-10.899(66)"),
        (12.34, 4.54, "12.3(4.5)"),
        (1234.5, 57.2, "1234(57)"),
        (1234.5, 572.0, "1230(570)"),
        (1.2346e-7, 5.6e-9, "1.235(56)e-07"),
        (0.0, 0.0123, "0.000(12)"),
        (2.0, 0.996, "2.0(1.0)"),
        (0.5, 0.0996, "0.50(10)"),
        (3.0, np.nan, "3"),
        (np.nan, np.nan, "–"),
    ],
)
def test_values_with_their_uncertainty_in_the_last_digits(value, sigma, text):
    assert concise(value, sigma) == text


@pytest.mark.parametrize(("model", "expected"), [("wang2013", 1.0), ("ggx+lambert", None)])
def test_chi2_knows_what_errors_have_in_common(model, expected):
    """A scale error of 3 % and errors of the incident angles hide neither noise nor a wrong model."""
    truth = get_model("wang2013")
    values = truth.vector(coverage.CASES["wang2013"][0])
    columns = 400.0 + np.arange(60, dtype=np.float64)
    scan = coverage.made_scan(truth, values, columns, np.random.default_rng(7), shared=False)
    fit = clbrdf.fit(scan, model=model, weights="sigma")
    if expected is None:
        assert fit.chi2_reduced.min() > 10.0
        assert fit.misfit.all()
    else:
        # χ²/ν scatters by √(2/ν); its mean over the columns by √(2/ν W). Six of these.
        spread = np.sqrt(2.0 / fit.goodness.degrees.mean() / len(columns))
        assert fit.chi2_reduced.mean() == pytest.approx(expected, abs=6.0 * spread)
        assert not fit.misfit.any()

"""AICc, BIC and reduced chi-squared against likelihoods written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from clbrdf.choose.criteria import Criteria, criteria
from clbrdf.choose.verdict import verdict


def test_with_known_uncertainties_they_differ_as_likelihoods_do():
    rng = np.random.default_rng(3)
    residuals, sigma = rng.standard_normal((2, 40)) * 0.3, 0.3
    found = criteria((residuals**2 / sigma**2).sum(axis=1), np.array([40, 40]), 4, True)
    likelihood = stats.norm.logpdf(residuals, scale=sigma).sum()
    constant = 80 * math.log(2.0 * math.pi * sigma**2)
    aic = -2.0 * likelihood - constant + 2 * 2 * 4
    assert found.aicc == pytest.approx(aic + 2 * (2 * 4 * 5 / (40 - 5)), rel=1e-12)
    assert found.bic == pytest.approx(-2.0 * likelihood - constant + 2 * 4 * math.log(40), rel=1e-12)
    assert found.degrees == 72
    assert found.chi2_reduced == pytest.approx((residuals**2).sum() / sigma**2 / 72, rel=1e-12)


def test_without_them_the_scale_is_one_more_parameter():
    residuals = np.random.default_rng(4).standard_normal(50)
    found = criteria(np.array([(residuals**2).sum()]), np.array([50]), 3, False)
    scale = np.sqrt((residuals**2).mean())  # of maximum likelihood
    likelihood = stats.norm.logpdf(residuals, scale=scale).sum()
    constant = 50 * (math.log(2.0 * math.pi) + 1.0)
    assert found.bic == pytest.approx(-2.0 * likelihood - constant + 4 * math.log(50), rel=1e-12)
    assert found.aicc == pytest.approx(-2.0 * likelihood - constant + 8 + 2 * 4 * 5 / (50 - 5), rel=1e-12)
    assert math.isnan(found.chi2_reduced)


def test_too_few_values_have_no_aicc():
    assert criteria(np.array([1.0]), np.array([5]), 4, True).aicc == math.inf


def test_wavelengths_without_values_do_not_count():
    some = criteria(np.array([3.0, 0.0]), np.array([30, 0]), 2, True)
    assert some == criteria(np.array([3.0]), np.array([30]), 2, True)


def test_no_model_fits_where_even_the_best_is_far_off():
    good, fair, bad = (Criteria(0.0, 0.0, value, 400) for value in (1.05, 1.6, 5.0))
    assert verdict([bad, good]) == ""
    assert verdict([fair, bad]) == ""
    assert "chi-squared of 5" in verdict([bad, bad])
    assert verdict([Criteria(0.0, 0.0, math.nan, 400)]) == ""


def test_few_degrees_of_freedom_speak_softly():
    # With 8 degrees of freedom reduced chi-squared has a standard deviation of 0.5.
    assert verdict([Criteria(0.0, 0.0, 3.0, 8)]) == ""
    assert verdict([Criteria(0.0, 0.0, 3.6, 8)]) != ""

"""(13) and (14) against their printed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import InputError
from clbrdf.objective import (
    objective,
    relative_rms,
    relative_rms_by_incident_angle,
    unweighted,
    weight_matrix,
)
from tests.reference import naive


@pytest.fixture
def noisy(small_scan):
    rng = np.random.default_rng(2)
    values = small_scan.brdf * (1.0 + 0.06 * rng.standard_normal(small_scan.brdf.shape))
    # Values that no uncertainty allows: far below zero, and zero with an unknown one.
    values[3, 1], values[7, 1], values[9, 2] = np.nan, -1000.0, 0.0
    sigma = small_scan.sigma.copy()
    sigma[9, 2] = np.nan
    return replace(small_scan, brdf=values, sigma=sigma)


def model_values(scan):
    return np.repeat(naive.brdf(naive.TIN_FOIL, scan.theta_i, scan.theta_r, scan.phi)[:, None], 3, axis=1)


def test_objective_is_equation_13(noisy):
    E = objective(model_values(noisy), noisy, weight_matrix(noisy))
    for k in range(3):
        assert E[k] == pytest.approx(naive.objective(naive.TIN_FOIL, noisy, k), rel=1e-12)


def test_weights_are_those_asked_for(noisy):
    g1, g2 = np.cos(np.deg2rad(noisy.theta_i)), np.cos(np.deg2rad(noisy.theta_r))
    for weights, printed in (
        ("relative", lambda k: noisy.brdf[:, k] ** -2.0),
        ("sigma", lambda k: noisy.sigma[:, k] ** -2.0),
        (g1 * g2, lambda k: g1 * g2),
    ):
        E = objective(model_values(noisy), noisy, weight_matrix(noisy, weights))
        for k in range(3):
            with np.errstate(divide="ignore"):
                assert E[k] == pytest.approx(naive.objective(naive.TIN_FOIL, noisy, k, printed(k)), rel=1e-12)


def test_relative_rms_is_equation_14(noisy):
    values, ours = model_values(noisy), relative_rms(model_values(noisy), noisy)
    by_angle = relative_rms_by_incident_angle(values, noisy)
    for k in range(3):
        good = ~noisy.mask[:, k]
        with np.errstate(divide="ignore"):
            ratio = (values[:, k] - noisy.brdf[:, k]) / noisy.brdf[:, k]
        assert ours[k] == pytest.approx(np.sqrt(np.mean(ratio[good] ** 2)), rel=1e-13)
        for i, angle in enumerate((30.0, 45.0, 60.0)):
            here = good & (noisy.theta_i == angle)
            assert by_angle[i, k] == pytest.approx(np.sqrt(np.mean(ratio[here] ** 2)), rel=1e-13)


def test_values_at_or_below_zero_are_masked_where_a_weight_needs_a_positive_value(small_scan):
    values, sigma = small_scan.brdf.copy(), np.full(small_scan.brdf.shape, 0.01)
    values[4, 0], values[5, 0], values[6, 0] = -0.02, 0.0, -0.06
    scan = replace(small_scan, brdf=values, sigma=sigma)
    low = np.s_[4:7, 0]
    assert scan.mask[low].tolist() == [False, False, True]  # −6σ is no noise
    assert weight_matrix(scan, "none")[low].tolist() == [1.0, 1.0, 0.0]
    assert weight_matrix(scan, "sigma")[low] == pytest.approx([1e4, 1e4, 0.0])
    assert weight_matrix(scan, "relative")[low].tolist() == [0.0, 0.0, 0.0]
    others = np.delete(np.arange(48), [4, 5, 6])
    ratio = model_values(scan)[others, 0] / values[others, 0] - 1.0
    assert relative_rms(model_values(scan), scan)[0] == pytest.approx(np.sqrt(np.mean(ratio**2)), rel=1e-12)


def test_a_wavelength_of_zeros_has_no_objective(small_scan):
    scan = replace(small_scan, brdf=np.zeros((48, 3)), sigma=np.ones((48, 3)))
    assert np.isnan(objective(model_values(scan), scan, weight_matrix(scan))).all()


@pytest.mark.parametrize("factor", [1e-150, 1e150])
@pytest.mark.parametrize("weights", ["none", "relative"])
def test_units_of_the_brdf_do_not_overflow_the_objective(noisy, factor, weights):
    E = objective(model_values(noisy), noisy, weight_matrix(noisy, weights))
    scaled = replace(noisy, brdf=noisy.brdf * factor, sigma=None)
    again = objective(model_values(noisy) * factor, scaled, weight_matrix(scaled, weights))
    np.testing.assert_allclose(again, E, rtol=1e-10)


def test_a_wavelength_with_nothing_left_has_no_objective(small_scan):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[:, 1] = 1
    scan = replace(small_scan, flags=flags)
    E = objective(model_values(scan), scan, weight_matrix(scan))
    assert np.isnan(E).tolist() == [False, True, False]
    assert np.isnan(relative_rms(model_values(scan), scan)).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ("heavy", "no weights are called 'heavy'; there are none, relative, sigma"),
        (np.ones(3), r"weights have shape \(3,\); give one for each of 48 directions"),
        (-np.ones(48), "finite, not negative"),
        (np.zeros(48), "not all 0"),
        (np.full(48, np.nan), "finite"),
    ],
)
def test_impossible_weights_are_refused(small_scan, weights, message):
    with pytest.raises(InputError, match=message):
        weight_matrix(small_scan, weights)


def test_sigma_weights_need_uncertainties(small_scan):
    with pytest.raises(InputError, match="need the scan's uncertainties"):
        weight_matrix(replace(small_scan, sigma=None), "sigma")


def test_values_without_a_weight_are_counted_by_reason(small_scan):
    sigma = small_scan.sigma.copy()
    sigma[:4, 0], sigma[4:7, 0] = np.nan, 0.0
    scan = replace(small_scan, sigma=sigma)
    counted = unweighted(scan, weight_matrix(scan, "sigma"))
    assert counted == {"without an uncertainty": 4, "with an uncertainty of 0": 3}
    assert unweighted(scan, weight_matrix(scan, "none")) == {}
    ones = np.ones(len(scan))
    ones[:2] = 0.0
    assert unweighted(small_scan, weight_matrix(small_scan, ones)) == {"of weight 0": 6}


def test_a_fit_without_any_weight_says_why(small_scan):
    scan = replace(small_scan, sigma=np.where(small_scan.theta_r[:, None] > 40.0, np.nan, 0.0) * np.ones(3))
    with pytest.raises(InputError, match=r"63 without an uncertainty, 81 with an uncertainty of 0\); give"):
        clbrdf.fit(scan, weights="sigma")


@pytest.mark.parametrize(("weights", "what"), [("relative", "a value"), ("sigma", "an uncertainty")])
def test_weights_that_would_be_infinite_are_refused(small_scan, weights, what):
    brdf, sigma = small_scan.brdf.copy(), small_scan.sigma.copy()
    brdf[4, 1], sigma[4, 1] = 1e-170, 1e-171
    with pytest.raises(InputError, match=f"the weight of {what} of 1e-17. 1/sr is infinite"):
        weight_matrix(replace(small_scan, brdf=brdf, sigma=sigma), weights)

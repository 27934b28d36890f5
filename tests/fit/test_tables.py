"""Tables 1 and 2 of the paper, as far as its data allow: scans made from Table 1 with noise of Table 2."""

from __future__ import annotations

import numpy as np
import pytest

import clbrdf
from clbrdf import Scan
from tests.reference import naive

# Table 2: σr of the fit for θi = 30°, 45°, 60°.
TABLE_2 = {"tin foil": (0.0882, 0.0994, 0.0953), "tile": (0.0884, 0.0875, 0.0841)}
TABLE_1 = {"tin foil": naive.TIN_FOIL, "tile": naive.CERAMIC_TILE}


def measured(name: str) -> Scan:
    """In plane, θr = 0 to 85°, twenty wavelengths of one truth, noise as large as Table 2 says."""
    theta_i, theta_r = np.repeat([30.0, 45.0, 60.0], 86), np.tile(np.arange(86.0), 3)
    truth = naive.brdf(TABLE_1[name], theta_i, theta_r, 180.0)[:, None] * np.ones(20)
    noise = np.repeat(TABLE_2[name], 86)[:, None]
    draws = np.random.default_rng(2013).standard_normal(truth.shape)
    sigma = noise * truth
    return Scan(
        theta_i,
        0.0,
        theta_r,
        180.0,
        np.arange(380.0, 780.0, 20.0),
        np.abs(truth + sigma * draws),
        sigma=sigma,
    )


@pytest.mark.parametrize("weights", ["sigma", "none"])
@pytest.mark.parametrize("name", TABLE_1)
def test_table_1_comes_back_within_the_error_bars(name, weights):
    fit = clbrdf.fit(measured(name), weights=weights)
    pulls = np.concatenate(
        [(fit.parameters[p] - v) / fit.sigma[p] for p, v in zip(fit.model.names, TABLE_1[name], strict=True)]
    )
    pulls = np.abs(pulls[np.isfinite(pulls)])  # at a bound there is no error bar
    assert len(pulls) >= (110 if weights == "sigma" else 60)
    # 68 % and 95 % of 120 pulls, in groups of six that hang together: standard deviations of about 6 % and
    # 3 %. Unweighted, the few values at the peaks decide, and error bars are less normal.
    slack = 1.0 if weights == "sigma" else 1.5
    assert np.mean(pulls < 1.0) == pytest.approx(0.683, abs=0.12 * slack)
    assert np.mean(pulls < 2.0) >= 0.954 - 0.06 * slack


@pytest.mark.parametrize("name", TABLE_1)
def test_table_2_comes_back_as_the_noise_put_in(name):
    fit = clbrdf.fit(measured(name), weights="sigma")
    for row, noise in zip(fit.goodness.relative_rms_by_incident_angle, TABLE_2[name], strict=True):
        # The mean of 20 standard deviations of 86 values each scatters by 1.7 %, less six parameters in 258.
        assert row.mean() == pytest.approx(noise, rel=0.06)

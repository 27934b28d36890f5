"""What residuals look like: noise and misfits of known shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.choose.angles import incident_groups
from clbrdf.choose.residuals import lag_one_correlation, mean_residuals, view_regions, worst_places

SIGNED = np.arange(-75.0, 75.1, 2.5)


def in_plane(seed=0):
    """Three incident angles, 61 signed view angles, two wavelengths, in a random order."""
    theta_i, signed = np.repeat([10.0, 40.0, 60.0], len(SIGNED)), np.tile(SIGNED, 3)
    order = np.random.default_rng(seed).permutation(len(signed))
    theta_i, signed = theta_i[order], signed[order]
    brdf = np.full((len(signed), 2), 0.3)
    return Scan(theta_i, 0.0, np.abs(signed), np.where(signed < 0, 0.0, 180.0), [500.0, 600.0], brdf), signed


def test_noise_has_no_memory():
    scan, _ = in_plane()
    found = [
        lag_one_correlation(scan, np.random.default_rng(seed).standard_normal(scan.brdf.shape))
        for seed in range(30)
    ]
    # 360 pairs: standard deviation 1/√360 = 0.053 each, 0.01 of the mean of 30.
    assert abs(np.mean(found)) < 0.04
    assert np.std(found) == pytest.approx(0.053, abs=0.02)


def test_a_wave_along_theta_r_has_one():
    scan, signed = in_plane()
    # Neighbours 2.5° apart on a wave of 30°: cos(2π 2.5/30) = 0.866, but for the ends.
    wave = np.sin(2.0 * np.pi * signed / 30.0)[:, None] * [1.0, 50.0]
    assert lag_one_correlation(scan, wave) == pytest.approx(np.cos(np.pi / 6.0), abs=0.02)
    # One that changes sign from each direction to the next.
    alternating = np.where(np.round((signed + 75.0) / 2.5) % 2 == 0, 1.0, -1.0)[:, None] * [1.0, 1.0]
    assert lag_one_correlation(scan, alternating) == pytest.approx(-1.0, abs=1e-12)


def test_the_order_of_directions_does_not_matter():
    one, signed = in_plane(1)
    other, again = in_plane(2)
    assert lag_one_correlation(one, np.sin(signed)[:, None] * [1, 1]) == pytest.approx(
        lag_one_correlation(other, np.sin(again)[:, None] * [1, 1]), rel=1e-12
    )


def test_scattered_directions_have_no_line():
    scan, _ = in_plane()
    phi = np.random.default_rng(5).uniform(0.0, 360.0, len(scan))
    assert np.isnan(lag_one_correlation(replace(scan, phi_r=phi), np.ones(scan.brdf.shape)))


def test_unused_values_break_a_line():
    scan, signed = in_plane()
    wave = np.sin(2.0 * np.pi * signed / 30.0)[:, None] * [1.0, 1.0]
    wave[np.abs(signed) == 20.0] = np.nan
    assert np.isfinite(lag_one_correlation(scan, wave))


def test_mean_residuals_are_relative_and_signed():
    scan, _ = in_plane()
    groups = incident_groups(scan)
    model = scan.brdf * (1.0 + np.array([0.1, 0.0, -0.2])[groups.group])[:, None]
    for weights in (np.ones(scan.brdf.shape), scan.brdf**-2.0):
        np.testing.assert_allclose(mean_residuals(scan, weights, model, groups), [0.1, 0.0, -0.2], atol=1e-14)


def test_the_worst_place_is_named_with_sign_and_size():
    scan, signed = in_plane()
    model = scan.brdf.copy()
    model[(scan.theta_i == 40.0) & (np.abs(signed - 40.0) <= 5.0)] *= 0.7
    worst, *rest = worst_places(scan, np.ones(scan.brdf.shape), model, incident_groups(scan))
    assert worst.theta_i == 40.0
    assert worst.region == "within 10° of the mirror direction"
    assert worst.share == pytest.approx(1.0)
    # 5 of the 9 directions within 10° lie 30 % too low.
    assert worst.deviation == pytest.approx(-0.3 * 5 / 9)
    assert not rest
    assert "θi = 40°" in worst.words()
    assert "17 % below" in worst.words()


def test_regions_are_about_the_mirror_direction():
    scan, signed = in_plane()
    names = view_regions(scan)
    for angle, value, start in ((40.0, 45.0, "within"), (40.0, 60.0, "forward, nearer to grazing")):
        assert names[(scan.theta_i == angle) & (signed == value)][0].startswith(start)
    assert names[(scan.theta_i == 60.0) & (signed == 20.0)][0] == "forward, nearer to the normal"
    assert names[(scan.theta_i == 60.0) & (signed == -60.0)][0].startswith("on the source's side")


def test_incident_angles_that_were_read_back_are_one():
    scan, _ = in_plane()
    shaken = replace(scan, theta_i=scan.theta_i + np.random.default_rng(3).uniform(-0.05, 0.05, len(scan)))
    groups = incident_groups(shaken)
    np.testing.assert_array_equal(groups.group, incident_groups(scan).group)
    np.testing.assert_allclose(groups.theta_i, [10.0, 40.0, 60.0], atol=0.05)
    assert incident_groups(scan).theta_i.tolist() == [10.0, 40.0, 60.0]

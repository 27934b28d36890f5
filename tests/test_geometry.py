"""Angles against 60-digit arithmetic, and the properties a geometry has to have."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import cos as exact_cos
from mpmath import mpf, radians
from mpmath import sin as exact_sin

from clbrdf import Directions, InputError
from clbrdf.geometry import (
    attenuation_times_cosines,
    cos2_gamma,
    cos_deg,
    one_minus_cos_gamma,
    sin2_gamma,
    sin_deg,
    trigonometry,
    wrap_azimuth,
)
from tests.reference import exact

zenith = st.one_of(st.floats(0.0, 89.999999), st.sampled_from([0.0, 1e-6, 30.0, 45.0, 85.0, 89.9, 89.999999]))
azimuth = st.one_of(st.floats(0.0, 359.999), st.sampled_from([0.0, 1e-6, 90.0, 179.999999, 180.0, 270.0]))

# Each result comes from fewer than ten rounded operations on values good to 2 ulp.
TOLERANCE = 20 * 2.0**-53


def relative(value, reference):
    return float(abs(mpf(float(value)) - reference) / abs(reference)) if reference != 0 else abs(float(value))


@given(angle=st.floats(-180.0, 180.0))
def test_sine_and_cosine_keep_relative_accuracy(angle):
    for ours, theirs in ((sin_deg, exact_sin), (cos_deg, exact_cos)):
        reference = theirs(radians(mpf(angle)))
        # Where the result is exactly 0 in real arithmetic, mpmath's own radians are off in digit 60.
        if abs(reference) > 1e-50:
            assert relative(ours(angle), reference) <= 4 * 2.0**-53


@given(theta_i=zenith, theta_r=zenith, phi=azimuth)
def test_half_angle_against_equation_10(theta_i, theta_r, phi):
    directions = Directions.relative(theta_i, theta_r, phi)
    cosine = exact.cos_gamma(theta_i, theta_r, phi)
    v = 1 - cosine
    if v > 1e-40:
        assert relative(one_minus_cos_gamma(trigonometry(directions))[0], v) <= TOLERANCE
        assert relative(sin2_gamma(trigonometry(directions))[0], 1 - cosine**2) <= TOLERANCE
    # cos²γ matters through 1 + cosγ only.
    assert float(cos2_gamma(trigonometry(directions))[0]) == pytest.approx(
        float(cosine**2), rel=1e-12, abs=1e-15
    )


@given(theta_i=zenith, theta_r=zenith, phi=azimuth)
def test_attenuation_against_equation_11(theta_i, theta_r, phi):
    i, r = (exact_cos(radians(mpf(angle))) for angle in (theta_i, theta_r))
    reference = exact.attenuation(theta_i, theta_r, phi) * i * r
    if reference > 1e-28:  # below, the printed form has lost the digits of mpmath itself
        value = attenuation_times_cosines(trigonometry(Directions.relative(theta_i, theta_r, phi)))[0]
        assert relative(value, reference) <= TOLERANCE


@given(theta_i=zenith, theta_r=zenith, phi=azimuth)
def test_exchange_of_incident_and_view_direction_changes_nothing(theta_i, theta_r, phi):
    there = trigonometry(Directions.relative(theta_i, theta_r, phi))
    back = trigonometry(Directions.relative(theta_r, theta_i, phi))
    for function in (one_minus_cos_gamma, attenuation_times_cosines):
        assert function(there)[0] == function(back)[0]


@given(theta_i=zenith, theta_r=zenith, phi=st.floats(0.0, 180.0))
def test_mirror_image_of_the_azimuth_changes_nothing(theta_i, theta_r, phi):
    # 360 - phi rounds: the tolerance is the angle's own rounding, seen through a slope of at most 1.
    left, right = (
        Directions.relative(theta_i, theta_r, phi),
        Directions.relative(theta_i, theta_r, 360.0 - phi),
    )
    np.testing.assert_allclose(
        one_minus_cos_gamma(trigonometry(left)),
        one_minus_cos_gamma(trigonometry(right)),
        rtol=1e-7,
        atol=1e-15,
    )


@pytest.mark.parametrize("theta", [0.0, 1e-6, 30.0, 60.0, 85.0, 89.999999])
def test_mirror_direction_is_exactly_at_gamma_zero(theta):
    assert one_minus_cos_gamma(trigonometry(Directions.relative(theta, theta, 180.0)))[0] == 0.0


@pytest.mark.parametrize("theta", [0.0, 30.0, 89.9])
def test_retro_direction_has_exactly_no_attenuation_factor(theta):
    assert attenuation_times_cosines(trigonometry(Directions.relative(theta, theta, 0.0)))[0] == 0.0


@given(phi=st.floats(-1e6, 1e6))
def test_azimuths_are_brought_to_one_turn(phi):
    assert 0.0 <= wrap_azimuth(np.array([phi]))[0] < 360.0


def test_lengths_broadcast_and_records_do_not_change():
    directions = Directions.relative([30.0, 45.0], 10.0, 540.0)
    assert len(directions) == 2
    assert directions.phi.tolist() == [180.0, 180.0]
    with pytest.raises(ValueError, match="read-only"):
        directions.theta_i[0] = 1.0


@pytest.mark.parametrize(
    ("angles", "message"),
    [
        (([30.0, 90.0], 0.0, 0.0), r"theta_i\[1\] is 90°"),
        ((30.0, -1e-9, 0.0), r"theta_r\[0\] is -1e-09°"),
        ((30.0, np.nan, 0.0), r"theta_r\[0\] is nan°"),
        ((30.0, 0.0, np.inf), r"phi\[0\] is inf"),
        (([1.0, 2.0], [1.0, 2.0, 3.0], 0.0), "do not belong together"),
        (([[1.0]], 0.0, 0.0), "2 dimensions"),
    ],
)
def test_impossible_angles_are_refused(angles, message):
    with pytest.raises(InputError, match=message):
        Directions.relative(*angles)

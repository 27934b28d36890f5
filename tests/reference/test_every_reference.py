"""What holds for every reference: reciprocity, isotropy, digits, gradients; and the points of domains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import cos as mcos
from mpmath import (
    fabs,
    isfinite,
    log,
    mpf,
    pi,
    radians,
    sqrt,
)

from tests.reference.integrals import WAVELENGTH
from tests.reference.models import REFERENCES, gradient
from tests.reference.models.domain import (
    HARD_DIRECTIONS,
    ROWS,
    Row,
    direction_points,
    domain_points,
    parameter_corners,
    parameter_points,
)
from tests.reference.models.geometry import Geometry

NAMES = sorted(REFERENCES)
NOT_RECIPROCAL = {"wang2013"}
ANISOTROPIC = {"ggx_anisotropic", "ward_anisotropic"}


def sample(name, count, seed=5):
    return zip(parameter_points(ROWS[name], count, seed), direction_points(count, seed + 1), strict=True)


@pytest.mark.parametrize("name", sorted(set(NAMES) - NOT_RECIPROCAL))
def test_directions_can_be_exchanged(name):
    for parameters, (theta_i, phi_i, theta_r, phi_r) in sample(name, 60):
        there = REFERENCES[name].value(parameters, theta_i, phi_i, theta_r, phi_r, WAVELENGTH)
        back = REFERENCES[name].value(parameters, theta_r, phi_r, theta_i, phi_i, WAVELENGTH)
        assert fabs(there - back) <= fabs(there) * mpf(10) ** -60 + mpf(10) ** -70


def test_wang2013_is_not_reciprocal():
    parameters = {"a": 3.0, "b": 0.5, "c": -20.0, "d": 0.7, "ks": 2.0, "kd": 0.1}
    there = REFERENCES["wang2013"].value(parameters, 30.0, 0.0, 60.0, 180.0)
    assert fabs(there - REFERENCES["wang2013"].value(parameters, 60.0, 180.0, 30.0, 0.0)) > there / 10


@pytest.mark.parametrize("name", sorted(set(NAMES) - ANISOTROPIC))
def test_turning_the_sample_or_looking_from_the_other_side_changes_nothing(name):
    for parameters, (theta_i, phi_i, theta_r, phi_r) in sample(name, 20):
        value = REFERENCES[name].value(parameters, theta_i, phi_i, theta_r, phi_r, WAVELENGTH)
        for i, r in ((phi_i + 64.0, phi_r + 64.0), (phi_i, phi_r + 360.0), (-phi_i, -phi_r)):
            turned = REFERENCES[name].value(parameters, theta_i, mpf(i), theta_r, mpf(r), WAVELENGTH)
            # Sums of azimuths round in the sixteenth digit; away from a peak that is what it makes.
            assert float(turned) == pytest.approx(float(value), rel=1e-5, abs=1e-60)


@pytest.mark.parametrize("name", NAMES)
def test_sixty_digits_hold_in_every_hard_case(name):
    twice = replace(REFERENCES[name], digits=2 * REFERENCES[name].digits)
    for number, angles in enumerate(HARD_DIRECTIONS.values()):
        corners = parameter_corners(ROWS[name])
        for parameters in corners[number % 3 :: 3]:
            value = REFERENCES[name].value(parameters, *angles, WAVELENGTH)
            better = twice.value(parameters, *angles, WAVELENGTH)
            assert isfinite(value)
            # What is exactly 0 comes out as a power of the last digit.
            assert fabs(value - better) <= fabs(better) * mpf(10) ** -60 + mpf(10) ** -70


@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_those_of_the_value(name):
    """Against a step a thousand times as wide, in more digits."""
    for parameters, angles in list(sample(name, 12)):
        slopes = gradient(name, parameters, angles, WAVELENGTH)
        assert list(slopes) == list(REFERENCES[name].parameters)
        for parameter, slope in slopes.items():
            assert isfinite(slope)
            low, high = REFERENCES[name].edges.get(parameter, (None, None))
            here = parameters[parameter]
            if here in (low, high):
                continue
            step = mpf(10) ** -20 * (fabs(mpf(here)) or 1)
            ends = [
                REFERENCES[name].value({**parameters, parameter: here + s * step}, *angles, WAVELENGTH)
                for s in (1, -1)
            ]
            assert (
                fabs((ends[0] - ends[1]) / (2 * step) - slope)
                <= fabs(slope) * mpf(10) ** -25 + mpf(10) ** -30
            )


def test_gradients_in_closed_form():
    angles = (50.0, 0.0, 20.0, 100.0)
    assert fabs(gradient("lambert", {"rho": 0.3}, angles)["rho"] - 1 / pi) < mpf(10) ** -50
    point = {"rho": 0.7, "k": 0.8}
    f = REFERENCES["minnaert"].value(point, *angles)
    cosines = mcos(radians(mpf(50))) * mcos(radians(mpf(20)))
    assert fabs(gradient("minnaert", point, angles)["k"] - f * (1 / mpf(1.8) + log(cosines))) < mpf(10) ** -14
    point = {"b0": 2.0, "x_k": 0.03, "g": 1.5}
    f, x = REFERENCES["abg"].value(point, *angles), Geometry(*angles).beta
    ratio = (x / mpf(0.03)) ** mpf(1.5)
    slopes = gradient("abg", point, angles)
    assert fabs(slopes["b0"] - f / 2) < mpf(10) ** -50
    assert fabs(slopes["x_k"] - f * mpf(1.5) / mpf(0.03) * ratio / (1 + ratio)) < mpf(10) ** -50
    assert fabs(slopes["g"] + f * ratio / (1 + ratio) * log(x / mpf(0.03))) < mpf(10) ** -50


def test_gradients_at_an_edge_are_one_sided():
    angles = (50.0, 0.0, 20.0, 100.0)
    at_edge = gradient("eon", {"rho": 0.6, "r": 0.0}, angles)["r"]
    inside = gradient("eon", {"rho": 0.6, "r": 1e-20}, angles)["r"]
    assert fabs(at_edge - inside) < fabs(inside) * mpf(10) ** -18
    smooth = {"w": 0.5, "b": 0.2, "c": 0.5, "theta_bar": 0.0, "h": 0.1, "B0": 0.5}
    # Roughness sets in with the square of the slope.
    assert fabs(gradient("hapke", smooth, angles)["theta_bar"]) < mpf(10) ** -29
    assert gradient("hapke", {**smooth, "theta_bar": 1.0}, angles)["theta_bar"] < -(mpf(10) ** -6)


def test_what_is_missing_is_said():
    with pytest.raises(ValueError, match="parameters are rho, k"):
        REFERENCES["minnaert"].value({"rho": 0.3}, 0, 0, 0, 0)
    with pytest.raises(ValueError, match="wavelength"):
        REFERENCES["rayleigh_rice"].value({"A": 1, "B": 1, "C": 2, "n": 2, "k": 0}, 0, 0, 0, 0)


@pytest.mark.parametrize("name", NAMES)
def test_points_stay_in_the_domain_and_repeat(name):
    points = domain_points(ROWS[name], 700, seed=3)
    assert points == domain_points(ROWS[name], 700, seed=3)
    assert points != domain_points(ROWS[name], 700, seed=4)
    assert len(points) == 700
    for parameters, (theta_i, _, theta_r, _) in points:
        assert tuple(parameters) == REFERENCES[name].parameters
        assert all(row.low <= parameters[row.name] <= row.high for row in ROWS[name])
        assert 0 <= theta_i <= 89.9
        assert 0 <= theta_r <= 89.9
    for row in ROWS[name]:
        assert {row.low, row.high} <= {parameters[row.name] for parameters, _ in points}


def test_random_directions_meet_what_is_hard():
    points = np.array(direction_points(3000, seed=7))
    theta_i, phi_i, theta_r, phi_r = points.T
    phi = phi_r - phi_i
    assert np.count_nonzero((theta_i == theta_r) & (phi == 180.0)) > 20
    assert np.count_nonzero((theta_i == theta_r) & (phi == 0.0)) > 20
    beside = np.abs(theta_i - theta_r)
    assert np.count_nonzero((beside > 0) & (beside < 1e-6)) > 50
    assert np.count_nonzero(theta_i > 89.0) > 50
    assert np.count_nonzero(theta_i < 1e-3) > 20
    assert np.count_nonzero(phi_i) > 1000
    plane = np.array(direction_points(300, seed=7, in_plane=True))
    assert set((plane[:, 3] - plane[:, 1]).tolist()) == {0.0, 180.0}


def test_a_logarithmic_row_needs_one_sign_and_a_floor():
    assert Row("c", -1e6, 0.0, "log", 1e-9).middle() == pytest.approx(-sqrt(1e-3))
    with pytest.raises(ValueError, match="needs a floor"):
        Row("ks", 0.0, 1.0, "log").middle()
    with pytest.raises(ValueError, match="one sign"):
        Row("a", -1.0, 1.0, "log").middle()
    with pytest.raises(ValueError, match="lin or log"):
        Row("a", -1.0, 1.0, "square").middle()

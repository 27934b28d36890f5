"""The parts of the model: they make up the whole, and what is read off amplitudes is right."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import Directions
from clbrdf.models import get_model
from tests.reference import naive

MODEL = get_model()
PARTS = MODEL.structure
BOUNDS = np.array([MODEL.parameter(name).bounds for name in PARTS.growth])


def test_the_parts_make_up_the_model():
    rng = np.random.default_rng(31)
    theta_i, theta_r, phi = rng.uniform(1, 85, 50), rng.uniform(1, 85, 50), rng.uniform(0, 360, 50)
    x = MODEL.features(Directions.relative(theta_i, theta_r, phi))
    a, b, c, d, ks, kd = naive.TIN_FOIL
    growth = PARTS.log_growth(np.array([a, b]), x[:, :1])
    parts = ks * np.exp(growth) * PARTS.lobes(np.array([[c, d]]), x)[0] + kd * PARTS.diffuse
    # The naive formula cancels near the mirror direction; 1e-9 holds away from it.
    np.testing.assert_allclose(parts, naive.brdf(naive.TIN_FOIL, theta_i, theta_r, phi), rtol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 6])
def test_growths_pass_through_amplitudes(count):
    """With ks free, some growth reproduces ratios of amplitudes that a growth made."""
    u = np.cos(np.radians(np.linspace(20.0, 70.0, count)))[:, None]
    log_amplitude = PARTS.log_growth(np.array([3.87, 0.5216]), u) + np.log(451.8)
    found = PARTS.growths(log_amplitude, np.ones(count), u, BOUNDS)
    assert ((found >= BOUNDS[:, 0]) & (found <= BOUNDS[:, 1])).all()
    left = log_amplitude - PARTS.log_growth(found, u)
    # The ridge of 1e-13 in the normal equations of condition 1e6 leaves about 1e-7.
    assert np.ptp(left, axis=-1).min() < 1e-5


def test_growths_at_their_limits_are_found():
    u = np.cos(np.radians([20.0, 40.0, 60.0]))[:, None]
    for a, b in ((20.0, 0.3), (-20.0, 0.6), (5.0, 2.0), (-5.0, -1.0)):
        found = PARTS.growths(PARTS.log_growth(np.array([a, b]), u), np.ones(3), u, BOUNDS)
        assert np.abs(found - [a, b]).max(axis=-1).min() < 1e-4


def test_shapes_keep_their_limits_and_cover_them():
    limits = np.array([MODEL.parameter(name).bounds for name in PARTS.shape])
    angles = np.arange(0.0, 86.0, 1.0)
    x = MODEL.features(Directions.relative(np.full(86, 45.0), angles, np.full(86, 180.0)))
    shapes, places = PARTS.shape_grid(x, limits)
    assert ((shapes >= limits[:, 0]) & (shapes <= limits[:, 1])).all()
    assert len(np.unique(places, axis=0)) == len(places) == len(np.unique(shapes, axis=0))
    # For any lobe, one of the grid is alike: within a quarter of its top in every direction.
    rng = np.random.default_rng(32)
    c, d = -np.exp2(rng.uniform(-3.0, 19.0, 200)), rng.uniform(0.2, 2.0, 200)
    bare = np.column_stack([x[:, :2], np.zeros(len(x))])
    wanted, grid = PARTS.lobes(np.column_stack([c, d]), bare), PARTS.lobes(shapes, bare)
    nearest = np.abs(wanted[:, None, :] - grid[None]).max(axis=-1).min(axis=1)
    assert nearest.max() < 0.25


def test_a_scan_of_one_direction_has_shapes_too():
    limits = np.array([MODEL.parameter(name).bounds for name in PARTS.shape])
    x = MODEL.features(Directions.relative([30.0], [30.0], [180.0]))
    shapes, _ = PARTS.shape_grid(x, limits)
    assert len(shapes) > 0
    assert np.isfinite(shapes).all()

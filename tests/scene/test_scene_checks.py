"""Energy and reciprocity of surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.models import get_model
from clbrdf.scene.checks import (
    cut_words,
    energy_words,
    measured_exchange,
    reciprocity_words,
    reflectance_of,
    worst_exchange,
)
from clbrdf.scene.surface import make_surface
from tests.reference import naive
from tests.scene.scenes import scene

ANGLES = np.array([30.0, 45.0, 60.0])
WAVE = np.array([550.0])


def surface_of(parameters, **more):
    values = dict(zip(get_model().names, parameters, strict=True)) if parameters else {}
    made = scene(surface={"parameters": values, **more})
    surface = make_surface(made)
    return surface, lambda directions: surface.values(directions, WAVE)


@pytest.mark.parametrize(
    ("parameters", "values"),
    [(naive.TIN_FOIL, (5.4316, 7.6321, 14.9503)), (naive.CERAMIC_TILE, (6.6072, 7.4743, 13.6820))],
    ids=["foil", "tile"],
)
def test_table_1(parameters, values):
    surface, brdf = surface_of(parameters)
    found = reflectance_of(brdf, ANGLES, surface.diverges(WAVE))
    assert found.max_zenith == 85.0
    np.testing.assert_allclose(found.values[:, 0], values, rtol=1e-5)  # they are given to five digits
    words = f"reflects more than it receives: {values[2]:.4g} times as much at θi = 60°"
    assert words in energy_words(found, WAVE)
    assert "θr = 85°" in cut_words(found)
    assert "diverges towards 90°" in cut_words(found)


@pytest.mark.parametrize(
    "more", [{"terms": ["diffuse"], "parameters": {"kd": 1.0}}, {"parameters": {"ks": 0.0, "kd": 1.0}}]
)
def test_lambert_over_the_whole_hemisphere(more):
    surface = make_surface(scene(surface=more))
    found = reflectance_of(lambda d: surface.values(d, WAVE), ANGLES, surface.diverges(WAVE))
    assert found.max_zenith == 90.0
    np.testing.assert_allclose(found.values, 1.0, rtol=1e-6)
    assert "no more than it receives" in energy_words(found, WAVE)
    assert "whole hemisphere" in cut_words(found)
    exchange = worst_exchange(lambda d: surface.values(d, WAVE), WAVE)
    assert reciprocity_words(exchange).startswith("reciprocal")


def test_the_model_is_not_reciprocal_by_its_fresnel_factor():
    _, brdf = surface_of(naive.TIN_FOIL)
    found = worst_exchange(brdf, WAVE)
    there = naive.brdf(naive.TIN_FOIL, found.theta_1, found.theta_2, found.phi)
    back = naive.brdf(naive.TIN_FOIL, found.theta_2, found.theta_1, found.phi)
    assert found.factor == pytest.approx(max(there / back, back / there), rel=1e-9)
    assert found.factor > 1.5
    assert "not reciprocal" in reciprocity_words(found)
    assert f"a factor of up to {found.factor:.4g}" in reciprocity_words(found)


def test_without_it_the_model_is():
    _, brdf = surface_of(None, terms=["specular", "attenuation", "diffuse"])
    assert worst_exchange(brdf, WAVE).factor == pytest.approx(1.0, rel=1e-9)


def test_measured_both_ways():
    theta = np.array([20.0, 50.0, 30.0])
    scan = Scan(theta, [0], theta[[1, 0, 2]], [170, 190, 180], [550, 600], [[2, 4], [2, 1], [9, 9]])
    found = measured_exchange(scan)
    assert (found.factor, found.wavelength) == (4.0, 600.0)
    assert sorted((found.theta_1, found.theta_2)) == [20.0, 50.0]
    assert measured_exchange(Scan([20.0], [0], [50.0], [180], [550], [[1.0]])) is None

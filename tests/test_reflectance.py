"""Directional-hemispherical reflectance against closed forms and another integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from clbrdf import InputError
from clbrdf.models import get_model
from clbrdf.reflectance import directional_hemispherical_reflectance, graded_grid, uniform_grid
from tests.reference import naive

NAMES = get_model().names
FOIL = dict(zip(NAMES, naive.TIN_FOIL, strict=True))
TILE = dict(zip(NAMES, naive.CERAMIC_TILE, strict=True))


@pytest.mark.parametrize(
    ("parameters", "values"),
    [(FOIL, (5.4316, 7.6321, 14.9503)), (TILE, (6.6072, 7.4743, 13.6820))],
    ids=["foil", "tile"],
)
def test_table_1_reflects_more_than_it_receives(parameters, values):
    for theta_i, value in zip((30.0, 45.0, 60.0), values, strict=True):
        assert directional_hemispherical_reflectance(parameters, theta_i) == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("theta_i", [0.0, 45.0, 89.0])
@pytest.mark.parametrize("cut", [60.0, 90.0])
def test_lambert_surface(theta_i, cut):
    value = directional_hemispherical_reflectance(FOIL | {"ks": 0.0, "kd": 1.0}, theta_i, max_zenith=cut)
    assert value == pytest.approx(np.sin(np.deg2rad(cut)) ** 2, rel=1e-12)


def test_against_another_integrator():
    p = (2.0, 0.5, -30.0, 0.6, 0.3, 0.2)

    def integrand(theta, phi):
        f = naive.brdf(p, 50.0, np.rad2deg(theta), np.rad2deg(phi))
        return 2.0 * f * np.cos(theta) * np.sin(theta)

    reference, _ = dblquad(integrand, 0.0, np.pi, 0.0, np.deg2rad(85.0), epsabs=1e-9, epsrel=1e-9)
    ours = directional_hemispherical_reflectance(dict(zip(NAMES, p, strict=True)), 50.0)
    assert ours == pytest.approx(reference, rel=1e-7)


@pytest.mark.parametrize("c", [-10.0, -1e6])
@pytest.mark.parametrize("d", [0.3, 1.0])
def test_more_points_change_nothing_for_broad_and_narrow_lobes(c, d):
    p = FOIL | {"c": c, "d": d, "a": 0.0, "ks": 1.0, "kd": 0.1}
    few = directional_hemispherical_reflectance(p, 60.0, points=12)
    many = directional_hemispherical_reflectance(p, 60.0, points=24)
    assert few == pytest.approx(many, rel=1e-7)


def test_many_parameter_sets_at_once():
    both = {name: np.array([FOIL[name], TILE[name]]) for name in NAMES}
    together = directional_hemispherical_reflectance(both, 45.0)
    alone = [directional_hemispherical_reflectance(p, 45.0) for p in (FOIL, TILE)]
    np.testing.assert_allclose(together, alone, rtol=1e-13)


def test_weights_are_projected_solid_angle():
    for grid in (graded_grid(30.0, 90.0, 8), uniform_grid(90.0, 400)):
        # The hemisphere's projected solid angle is π; midpoints miss it by their curvature.
        assert grid.weight.sum() == pytest.approx(np.pi, rel=1e-5)


@pytest.mark.parametrize(("theta_i", "cut"), [(90.0, 85.0), (30.0, 0.0), (30.0, 91.0), (30.0, np.nan)])
def test_impossible_angles_are_refused(theta_i, cut):
    with pytest.raises(InputError, match=r"theta_i|max_zenith"):
        directional_hemispherical_reflectance(FOIL, theta_i, max_zenith=cut)

"""Integrals over aperture, beam and slit against brute force and closed forms."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.integrate import quad

from clbrdf.instrument.aperture import solid_angle
from clbrdf.instrument.bandwidth import Bandwidth, slit_nodes
from clbrdf.instrument.cone import cone_nodes
from clbrdf.instrument.vectors import mirrored, pair_of_vectors
from clbrdf.opencl.precision import PRECISIONS
from clbrdf.scene import simulate
from clbrdf.scene.quadrature import ORDERS, Told, integrate
from clbrdf.scene.simulate import set_up
from clbrdf.scene.surface import make_surface
from tests.reference import naive
from tests.scene.scenes import brute_aperture, brute_beam, scene


def value(made):
    return simulate(made).brdf[0, 0]


# At the mirror direction, inside the cone, on its rim, just beyond it, off the plane, far away.
PLACES = [(60.0, 180.0), (60.4, 180.0), (61.0, 180.0), (61.1, 180.0), (60.0, 180.7), (30.0, 90.0)]


@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize(("theta_r", "phi"), PLACES)
def test_aperture_of_2_degrees_on_tin_foil_at_60(theta_r, phi, rtol):
    """The brute force is good to 1e-10: twice the panels change it by less."""
    ours = value(scene(60, theta_r, phi_r=phi, rtol=rtol, effects={"aperture": {"angle": 2.0}}))
    assert ours == pytest.approx(brute_aperture(60.0, theta_r, phi, 2.0), rel=rtol)


def test_brute_force_has_converged():
    once, twice = (brute_aperture(60.0, 60.4, 180.0, 2.0, panels=n) for n in (40, 80))
    assert once == pytest.approx(twice, rel=1e-10)


@pytest.mark.parametrize(("theta_r", "phi"), PLACES)
def test_beam_of_2_degrees(theta_r, phi):
    ours = value(scene(60, theta_r, phi_r=phi, rtol=1e-6, effects={"beam": {"angle": 2.0}}))
    assert ours == pytest.approx(brute_beam(60.0, theta_r, phi, 2.0), rel=1e-6)


def test_a_tolerance_costs_nodes():
    """The finer the tolerance, the higher the orders that the search ends with, and the more it evaluates."""
    spent = []

    class Counting:
        def __init__(self, inner):
            self.inner = inner

        def mean(self, nodes, *rest):
            spent[-1] += len(nodes)
            return self.inner.mean(nodes, *rest)

    for rtol in (1e-2, 1e-4, 1e-6, 1e-8):
        made = scene(60, [58, 60, 60.5], rtol=rtol, effects={"aperture": {"angle": 2.0}})
        spent.append(0)
        surface, true = Counting(make_surface(made)), set_up(made).true
        integrate(surface, made.effects, true, np.array([550.0]), rtol, Told())
    assert spent == sorted(set(spent))


def test_narrow_lobes_are_not_missed():
    """A lobe of 0.01° in a cone of 2°: the nodes gather at the mirror direction."""
    p = dict(zip(["a", "b", "c", "d", "ks", "kd"], (0.0, 0.5, -3e6, 1.0, 1e4, 0.1), strict=True))
    made = scene(60, 60.3, rtol=1e-5, surface={"parameters": p}, effects={"aperture": {"angle": 2.0}})

    # In polar coordinates about the mirror direction the lobe alone is 2π ∫ f(r) sin r dr; the cone holds it.
    def ring(r):
        v = 2 * np.sin(r / 4) ** 2
        return np.exp(-3e6 * v) * np.sin(r)

    # G / (π cosθi cosθr) and cosθ change by less than 1e-3 over the lobe.
    front = 1e4 * 2 * np.tan(np.deg2rad(60)) / (np.pi * 0.25)
    lobe = front * 2 * np.pi * quad(ring, 0, 0.01, limit=200)[0] * 0.5
    expected = lobe / (solid_angle(2.0) * np.cos(np.deg2rad(60.3))) + 0.1 / np.pi
    assert value(made) == pytest.approx(expected, rel=2e-3)


def test_both_cones_at_once():
    """Beam outside, aperture inside: brute force over one, brute force over the other."""
    from tests.scene.scenes import angles_of, cone_grid

    vectors, solid = cone_grid(60.0, 0.0, 0.8, panels=4, points=6)
    theta, azimuth = angles_of(vectors)
    inner = [brute_aperture(t, 60.5, 180.0 - a, 1.5, panels=8) for t, a in zip(theta, azimuth, strict=True)]
    expected = (solid * inner).sum() / solid.sum()
    ours = value(scene(60, 60.5, rtol=1e-5, effects={"aperture": {"angle": 1.5}, "beam": {"angle": 0.8}}))
    assert ours == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("effect", ["aperture", "beam"])
def test_narrow_cones_vanish(effect):
    plain = value(scene(60, 61))
    # The mean over a cone differs by its angle squared: (0.002° in rad)² against a lobe of 4°.
    assert value(scene(60, 61, effects={effect: {"angle": 0.002}})) == pytest.approx(plain, rel=1e-5)


def test_weights_add_up_to_the_solid_angle():
    rng = np.random.default_rng(1)
    axis = rng.standard_normal((40, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    centre = axis + 0.05 * rng.standard_normal((40, 3))
    centre /= np.linalg.norm(centre, axis=1)[:, None]
    nodes, weights = cone_nodes(axis, centre, 0.04, 24)
    # Order 24; the square root at the rim is integrated to a few 1e-7.
    np.testing.assert_allclose(weights.sum(axis=1), 2 * np.pi * (1 - np.cos(0.04)), rtol=1e-6)
    assert ((nodes * axis[:, None]).sum(axis=-1) >= np.cos(0.04) - 1e-12).all()
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=-1), 1.0, rtol=1e-14)


def test_mirror_directions():
    source, _ = pair_of_vectors(set_up(scene(40, 10)).nominal)
    np.testing.assert_allclose(mirrored(source)[0], [-np.sin(np.deg2rad(40)), 0, np.cos(np.deg2rad(40))])


SURFACE = {"parameters": {"ks": {"polynomial": [1.0, 0.0, 2e-4], "centre": 540}, "kd": 0, "a": 0, "c": -10}}


class TestBandwidth:
    @pytest.mark.parametrize(
        ("shape", "second_moment"),
        [
            ("triangle", 8.0**2 / 6),
            ("rectangle", 8.0**2 / 12),
            # Cut at 5 σ: 1 − 2 · 5 φ(5) / (1 − 6e-7)
            ("gauss", 8.0**2 / (8 * np.log(2)) * (1 - 10 * np.exp(-12.5) / np.sqrt(2 * np.pi))),
        ],
    )
    def test_a_parabola_in_wavelength(self, shape, second_moment):
        """For ks = 1 + q (λ − λ0)² the slit adds q times its second moment: a closed form."""
        plain = simulate(scene(50, 20, [520, 540, 600], surface=SURFACE)).brdf[0]
        effects = {"bandwidth": {"width": 8.0, "shape": shape}}
        bent = simulate(scene(50, 20, [520, 540, 600], surface=SURFACE, rtol=1e-9, effects=effects))
        ks = 1 + 2e-4 * (np.array([520, 540, 600]) - 540.0) ** 2
        np.testing.assert_allclose(bent.brdf[0] / plain, 1 + 2e-4 * second_moment / ks, rtol=1e-8)

    def test_a_narrow_slit_vanishes(self):
        plain = simulate(scene(50, 20, [520, 540], surface=SURFACE)).brdf
        bent = simulate(scene(50, 20, [520, 540], surface=SURFACE, effects={"bandwidth": {"width": 1e-3}}))
        np.testing.assert_allclose(bent.brdf, plain, rtol=1e-9)  # q · width² / 6 is 3e-11

    @pytest.mark.parametrize("order", ORDERS["bandwidth"])
    def test_shares_add_up(self, order):
        offsets, shares = slit_nodes(Bandwidth(), order)
        assert shares.sum() == pytest.approx(1.0, rel=1e-14)
        assert (shares * offsets).sum() == pytest.approx(0.0, abs=1e-14)

    def test_with_an_aperture(self):
        """ks is a factor of the specular part, so that both means come apart."""
        both = {"bandwidth": {"width": 8.0}, "aperture": {"angle": 2.0}}
        one = simulate(scene(50, 52, 540, surface=SURFACE, rtol=1e-8, effects=both)).brdf[0, 0]
        cone = {"aperture": {"angle": 2.0}}
        alone = simulate(scene(50, 52, 540, surface=SURFACE, rtol=1e-8, effects=cone)).brdf[0, 0]
        assert one / alone == pytest.approx(1 + 2e-4 * 64 / 6, rel=1e-7)


@pytest.mark.parametrize("name", list(PRECISIONS))
def test_every_precision(name):
    made = scene(60, [20, 59, 60], rtol=1e-6, effects={"aperture": {"angle": 2.0}})
    exact = simulate(made).brdf
    ours = simulate(made.model_copy(update={"precision": name, "rtol": 1e-3})).brdf
    # The bound of the arithmetic, and the tolerance of the integral.
    np.testing.assert_allclose(ours, exact, rtol=PRECISIONS[name].bound + 1e-3)


def test_a_lambert_surface_sees_no_cone():
    """∫ cosθ dω over a cone is Ω cosθr (1 + cos R) / 2: the mean of a constant BRDF is that much smaller."""
    surface = {"terms": ["diffuse"], "parameters": {"kd": 1.0}}
    ours = value(scene(60, 50, surface=surface, rtol=1e-9, effects={"aperture": {"angle": 10.0}}))
    assert ours == pytest.approx((1 + np.cos(np.deg2rad(5.0))) / 2 / np.pi, rel=1e-9)
    ours = value(scene(60, 50, surface=surface, rtol=1e-9, effects={"beam": {"angle": 10.0}}))
    assert ours == pytest.approx(1 / np.pi, rel=1e-9)


def test_what_cannot_be_reached_is_told():
    """A measured surface is a patchwork: no order brings its mean to 1e-9, and the search says so."""
    made = scene(60, 60, rtol=1e-9, effects={"aperture": {"angle": 2.0}})

    class Patchwork:
        def mean(self, nodes, weights, *rest):
            steps = np.floor(nodes.theta_r * 3.7) + np.floor(nodes.phi * 2.3)
            return (weights * (1.0 + steps % 3).reshape(weights.shape)).sum(axis=1)[:, None]

    told = Told()
    began = time.perf_counter()
    integrate(Patchwork(), made.effects, set_up(made).true, np.array([550.0]), 1e-9, told)
    assert time.perf_counter() - began < 5.0
    count, change = told.short["aperture"]
    assert count == 1
    assert 1e-9 < change < 0.1


def test_naive_reference_is_what_no_effect_gives():
    assert value(scene(60, 55)) == pytest.approx(naive.brdf(naive.TIN_FOIL, 60, 55, 180), rel=1e-9)

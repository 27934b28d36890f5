"""Each effect on values against an independent solution, and the limit in which it vanishes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from clbrdf import InputError
from clbrdf.instrument.footprint import Footprint, seen_share
from clbrdf.scene import simulate
from clbrdf.scene.effects.shot_noise import EXPANDED_FROM, poisson_quantile
from clbrdf.scene.random_numbers import normal, uniform
from clbrdf.scene.scenefile import EFFECTS
from clbrdf.scene.simulate import set_up
from tests.reference import naive
from tests.scene.scenes import scene

WAVES = {"start": 400, "stop": 700, "step": 50}
ZENITHS = {"start": 0, "stop": 80, "step": 10}
LIT = {"integration_time": 0.02, "lamp_temperature": 3000.0}


def brdf(effects, **more):
    more = {"theta_i": 50, "theta_r": ZENITHS, "wavelength": WAVES, **more}
    return simulate(scene(effects=effects, **more)).brdf


@pytest.fixture(scope="module")
def plain():
    return brdf({})


def counts_per_brdf(theta_r, seconds=0.02, solid=1e-3, rate=1e8):
    """Counts for 1/sr, from Planck's law in photons and the responsivity that detector.py states."""
    waves = np.arange(400.0, 701.0, 50.0)
    planck = 1 / (
        waves**4 * (np.exp(6.62607015e-34 * 2.99792458e8 / (1.380649e-23 * waves * 1e-9 * 3000)) - 1)
    )
    spectrum = planck * np.exp(-(((waves - 600) / 250) ** 2))
    return rate * seconds * solid * np.cos(np.deg2rad(theta_r))[:, None] * spectrum / spectrum.max()


SCALE = counts_per_brdf(np.arange(0.0, 81.0, 10.0))


class TestFootprint:
    @pytest.mark.parametrize("beam", [3.0, 9.0, 30.0])
    def test_against_counted_points(self, beam):
        """Points spread evenly over the lit spot; those in the field of view are counted."""
        grid = set_up(scene([0, 40, 80], [0, 50, 85], phi_r=[0, 30, 90, 180])).nominal
        ours = seen_share(Footprint(beam=beam, field=10.0), grid)
        n = 1500
        x, y = np.meshgrid((np.arange(n) + 0.5) / n * 2 - 1, (np.arange(n) + 0.5) / n * 2 - 1)
        spot = np.stack([x, y])[:, x**2 + y**2 < 1] * beam / 2
        for i, r, phi, share in zip(grid.theta_i, grid.theta_r, np.deg2rad(grid.phi), ours, strict=True):
            lit = spot[0] / np.cos(np.deg2rad(i)), spot[1]
            along = (lit[0] * np.cos(phi) + lit[1] * np.sin(phi)) * np.cos(np.deg2rad(r))
            across = -lit[0] * np.sin(phi) + lit[1] * np.cos(phi)
            seen = np.mean(along**2 + across**2 < 25.0)
            # 1.8e6 points on a grid: its edge leaves about 1e-4 of a share.
            assert share == pytest.approx(seen, abs=1e-3)

    def test_it_multiplies(self, plain):
        bent = brdf({"footprint": {"beam": 20.0, "field": 10.0}})
        # In plane, with the spot longer and wider than the field: its area over that of the spot.
        theta = np.deg2rad(np.arange(0.0, 51.0, 10.0))
        share = (10 / 20) ** 2 * np.cos(np.deg2rad(50)) / np.cos(theta)
        np.testing.assert_allclose((bent / plain)[: len(share), 0], share, rtol=1e-12)

    def test_a_narrow_beam_is_seen_whole(self, plain):
        np.testing.assert_array_equal(brdf({"footprint": {"beam": 0.01}}), plain)


NONE = {"tilt": 0, "height": 0, "stage_i": 0, "stage_r": 0}


class TestMisalignment:
    def test_tilt_in_plane_turns_both_zeniths(self):
        """Leaning by 2° away from the source: θi grows by 2°, θr on the other side falls by it."""
        bent = brdf({"misalignment": {**NONE, "tilt": 2, "tilt_azimuth": 180}}, theta_r=[40, 50])
        theta = np.array([40.0, 50.0])
        true = naive.brdf(naive.TIN_FOIL, 52.0, theta - 2, 180.0)
        factor = np.cos(np.deg2rad(theta - 2)) / np.cos(np.deg2rad(theta))
        np.testing.assert_allclose(bent[:, 0], true * factor, rtol=1e-8)

    def test_tilt_out_of_plane(self):
        """A general tilt, with the angles from scalar products with the leaning normal."""
        tilt, azimuth = np.deg2rad([7.0, 65.0])
        bent = brdf({"misalignment": {**NONE, "tilt": 7, "tilt_azimuth": 65}}, theta_r=40, phi_r=120)
        normal_ = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
        i, r, p = np.deg2rad([50.0, 40.0, 120.0])
        s = np.array([np.sin(i), 0, np.cos(i)])
        v = np.array([np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)])
        flat = [a - normal_ * (a @ normal_) for a in (s, v)]
        phi = np.arccos(flat[0] @ flat[1] / np.linalg.norm(flat[0]) / np.linalg.norm(flat[1]))
        angles = [np.arccos(a @ normal_) for a in (s, v)] + [phi]
        true = naive.brdf(naive.TIN_FOIL, *np.rad2deg(angles)) * (v @ normal_) / np.cos(r)
        assert bent[0, 0] == pytest.approx(true, rel=1e-8)

    def test_height_moves_the_spot(self):
        """Plane triangles: the beam meets the face h/cosθi from the axis, on the source's side."""
        h, length = 3.0, 200.0
        effect = {"misalignment": {**NONE, "height": h, "distance": length}}
        bent = brdf(effect, theta_r=[40, 50])
        for k, theta in enumerate(np.deg2rad([40.0, 50.0])):
            x, z = (
                -h * np.tan(np.deg2rad(50)),
                h,
            )  # the source stands at negative x here, the detector at positive
            dx, dz = length * np.sin(theta) - x, length * np.cos(theta) - z
            true = np.arctan2(dx, dz)
            factor = length**2 / (dx**2 + dz**2) * np.cos(true) / np.cos(theta)
            f = naive.brdf(naive.TIN_FOIL, 50.0, np.rad2deg(true), 180.0)
            assert bent[k, 0] == pytest.approx(f * factor, rel=1e-8)

    def test_stages_scatter_by_their_standard_deviation(self):
        made = scene(
            30,
            {"start": 10, "stop": 60, "step": 0.01},
            effects={"misalignment": {**NONE, "stage_i": 0.1, "stage_r": 0.2}},
        )
        ready = set_up(made)
        off_i = ready.true.theta_i - ready.nominal.theta_i
        off_r = ready.true.theta_r - ready.nominal.theta_r
        # 5001 draws: standard deviations are good to 1 %; four of that.
        assert off_i.std() == pytest.approx(0.1, rel=0.04)
        assert off_r.std() == pytest.approx(0.2, rel=0.04)
        assert abs(np.corrcoef(off_i, off_r)[0, 1]) < 0.06
        np.testing.assert_allclose(ready.true.phi, 180.0, atol=1e-9)

    def test_it_vanishes(self, plain):
        # Angles go through vectors and back: 1e-14 rad, against a lobe whose slope is some 100 a radian.
        np.testing.assert_allclose(brdf({"misalignment": NONE}), plain, rtol=1e-11)

    def test_behind_the_face(self):
        with pytest.raises(InputError, match="behind the tilted face"):
            brdf({"misalignment": {**NONE, "tilt": 20, "tilt_azimuth": 0}}, theta_r=80)


class TestLampDrift:
    def test_a_straight_line_in_time(self, plain):
        bent = brdf({"lamp_drift": {"per_hour": 0.5, "interval": 72.0}})
        np.testing.assert_allclose(bent / plain, 1 + 0.01 * np.arange(9)[:, None] * np.ones(7), rtol=1e-14)

    def test_it_vanishes(self, plain):
        np.testing.assert_array_equal(brdf({"lamp_drift": {"per_hour": 0.0}}), plain)


class TestStrayLight:
    def test_an_even_background_of_counts(self, plain):
        bent = brdf({"stray_light": {"share": 0.02}}, detector=LIT)
        background = 0.02 * (plain * SCALE).mean(axis=1, keepdims=True)
        np.testing.assert_allclose(bent, plain + background / SCALE, rtol=1e-6)  # hc/k is known to 6 digits

    def test_it_vanishes(self, plain):
        np.testing.assert_allclose(brdf({"stray_light": {"share": 0.0}}), plain, rtol=1e-14)


class TestDark:
    def test_left_in(self, plain):
        bent = brdf({"dark": {"rate": 50.0, "subtracted": False}}, detector=LIT)
        np.testing.assert_allclose(bent, plain + 50.0 * 0.02 / SCALE, rtol=1e-6)

    def test_what_drift_leaves(self, plain):
        bent = brdf({"dark": {"rate": 50.0, "drift": 0.1, "interval": 3600.0}}, detector=LIT)
        hours = np.arange(9)[:, None]
        np.testing.assert_allclose(bent, plain + 50.0 * 0.02 * 0.1 * hours / SCALE, rtol=1e-6)

    def test_it_vanishes(self, plain):
        np.testing.assert_allclose(brdf({"dark": {"rate": 0.0, "subtracted": False}}), plain, rtol=1e-14)


class TestNonlinearity:
    def test_a_quadratic_equation(self, plain):
        """x / (1 + 0.05 x / S) = n: x = n / (1 − 0.05 n / S)."""
        bent = brdf({"nonlinearity": {"polynomial": [1.0, 0.05]}}, detector={**LIT, "direct_rate": 1e6})
        net = plain * SCALE / 100
        np.testing.assert_allclose(bent, plain / (1 - 0.05 * net / 16383), rtol=1e-6)
        assert (bent / plain - 1).max() > 1e-3

    def test_it_vanishes(self, plain):
        np.testing.assert_allclose(brdf({"nonlinearity": {"polynomial": [1.0]}}), plain, rtol=1e-14)

    def test_an_impossible_polynomial(self):
        with pytest.raises(ValueError, match=r"keep it between 0.5 and 2"):
            scene(effects={"nonlinearity": {"polynomial": [1.0, 3.0]}})


class TestSaturation:
    def test_it_cuts_and_flags(self, plain):
        made = scene(50, ZENITHS, WAVES, effects={"saturation": True}, detector=LIT)
        scan = simulate(made)
        top = (16383.0 - 1500.0) / SCALE
        cut = plain >= top
        assert 0 < np.count_nonzero(cut) < cut.size
        np.testing.assert_allclose(scan.brdf, np.minimum(plain, top), rtol=1e-6)
        np.testing.assert_array_equal(scan.mask, cut)
        assert scan.flag_counts() == {"saturated": np.count_nonzero(cut)}

    def test_dark_takes_room(self, plain):
        scan = simulate(
            scene(50, ZENITHS, WAVES, effects={"saturation": True, "dark": {"rate": 1e5}}, detector=LIT)
        )
        top = (16383.0 - 1500.0 - 2000.0) / SCALE
        np.testing.assert_allclose(scan.brdf, np.minimum(plain, top), rtol=1e-6)

    def test_it_vanishes(self, plain):
        scan = simulate(
            scene(50, ZENITHS, WAVES, effects={"saturation": True}, detector={"full_scale": 1e9, **LIT})
        )
        np.testing.assert_allclose(scan.brdf, plain, rtol=1e-14)
        assert not scan.mask.any()


class TestNoise:
    def pulls(self, effects, **more):
        made = scene(50, {"start": 0, "stop": 80, "step": 0.1}, WAVES, effects=effects, **more)
        scan, truth = simulate(made), simulate(made.model_copy(update={"effects": scene().effects})).brdf
        return (scan.brdf - truth) / scan.sigma, scan.sigma, truth

    @pytest.mark.parametrize("name", ["shot_noise", "read_noise", "reader"])
    def test_values_scatter_as_their_uncertainties_say(self, name):
        z, _, _ = self.pulls({name: {}})
        # 5607 draws: mean to 0.013, standard deviation to 0.0095; four of that.
        assert abs(z.mean()) < 0.054
        assert z.std() == pytest.approx(1.0, abs=0.038)

    def test_shot_noise_is_poissons(self):
        _, sigma, truth = self.pulls({"shot_noise": {}}, detector=LIT)
        scale = counts_per_brdf(np.arange(801) * 0.1)
        np.testing.assert_allclose(sigma, np.sqrt(truth * scale / 2.0) / scale, rtol=1e-6)

    def test_dark_charge_makes_noise_and_no_signal(self):
        effects = {"shot_noise": {}, "dark": {"rate": 1e6}}
        z, sigma, truth = self.pulls(effects, detector=LIT)
        scale = counts_per_brdf(np.arange(801) * 0.1)
        np.testing.assert_allclose(sigma, np.sqrt((truth * scale + 2e4) / 2.0) / scale, rtol=1e-6)
        assert abs(z.mean()) < 0.054

    def test_read_noise_is_counts(self):
        _, sigma, _ = self.pulls({"read_noise": {"sigma": 5.0}}, detector=LIT)
        np.testing.assert_allclose(sigma, 5.0 / counts_per_brdf(np.arange(801) * 0.1), rtol=1e-6)

    def test_reader_is_the_papers(self):
        _, sigma, truth = self.pulls({"reader": True})
        np.testing.assert_allclose(sigma, 0.0484 * truth, rtol=1e-12)

    def test_one_reader_a_direction_or_a_scan(self, plain):
        factor = brdf({"reader": {"each": "direction"}}) / plain
        np.testing.assert_allclose(factor, factor[:, :1] * np.ones(7), rtol=1e-13)
        assert len(np.unique(factor[:, 0])) == 9
        factor = brdf({"reader": {"each": "scan"}}) / plain
        np.testing.assert_allclose(factor, factor[0, 0], rtol=1e-13)

    def test_they_vanish(self, plain):
        np.testing.assert_array_equal(brdf({"reader": {"percent": 0}}), plain)
        np.testing.assert_allclose(brdf({"read_noise": {"sigma": 0}}), plain, rtol=1e-14)
        # Shot noise falls as the root of the charge: 1e-6 at 1e12 electrons. It is bounded at 1e9 of them.
        lit = {"integration_time": 1e-3, "electrons_per_count": 1e6}
        np.testing.assert_allclose(brdf({"shot_noise": {}}, detector=lit, theta_r=20), plain[2:3], rtol=3e-4)

    def test_independent_of_each_other(self):
        draws = [normal(3, name, 0, 100, 100).ravel() for name in EFFECTS]
        # 10,000 draws: correlations are good to 0.01; 78 pairs, five of that.
        assert np.abs(np.corrcoef(draws) - np.eye(len(draws))).max() < 0.05


class TestRandomNumbers:
    def test_blocks_of_any_size_give_the_same(self):
        whole = uniform(7, "reader", 0, 50, 7)
        for size in (1, 3, 50):
            parts = [uniform(7, "reader", k, min(size, 50 - k), 7) for k in range(0, 50, size)]
            np.testing.assert_array_equal(np.concatenate(parts), whole)

    def test_they_are_uniform_and_normal(self):
        assert stats.kstest(uniform(1, "x", 0, 200, 100).ravel(), "uniform").pvalue > 0.01
        assert stats.kstest(normal(1, "x", 0, 200, 100).ravel(), "norm").pvalue > 0.01

    @pytest.mark.parametrize("mean", [1e-3, 0.5, 7.0, 99.0, EXPANDED_FROM, 300.0, 1e4, 1e7])
    def test_poisson_by_inversion(self, mean):
        u = uniform(2, "x", 0, 100, 200)
        ours, exact = poisson_quantile(np.full(u.shape, mean), u), stats.poisson.ppf(u, mean)
        assert np.abs(ours - exact).max() <= 1
        # The expansion's next term is of order 1/m: some 0.003 of an electron at 100, where a step is 1.
        assert np.mean(ours != exact) < (0.005 if mean >= EXPANDED_FROM else 1e-9)

    def test_no_light_no_electrons(self):
        assert (poisson_quantile(np.array([0.0, -5.0, 1e-300]), np.full(3, 0.999)) == 0).all()
        assert np.isnan(poisson_quantile(np.array([np.nan]), np.array([0.5]))).all()


ALL = dict.fromkeys(EFFECTS, True)


@pytest.mark.parametrize("block_values", [7, 40, 1 << 20])
def test_no_block_size_changes_a_value(block_values):
    """With every effect on; integrals choose their nodes direction by direction."""
    made = scene([30, 50], [0, 30, 50, 70], WAVES, seed=4, rtol=1e-2, effects=ALL)
    whole, parts = simulate(made), simulate(made, block_values=block_values)
    np.testing.assert_array_equal(parts.brdf, whole.brdf)
    np.testing.assert_array_equal(parts.sigma, whole.sigma)


def test_seeds_matter():
    made = scene(50, 50, WAVES, effects={"reader": True})
    one, same, other = (simulate(made.model_copy(update={"seed": k})).brdf for k in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (one != other).all()

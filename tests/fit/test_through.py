"""Fits through the instrument: what scenes put in, fits take out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, InputError
from clbrdf.bench.through import FIXED, SURFACES, bias, fit_both_ways, half_width, seen_scan
from clbrdf.instrument.settings import Instrument
from clbrdf.optimizers.check import check_fit
from clbrdf.scene import simulate
from tests.scene.scenes import scene

NAME = "ggx+lambert"
TRUTH = SURFACES[NAME]


def through(**effects):
    return Instrument.model_validate(effects)


def fitted(scan, told, **options):
    return clbrdf.fit(scan, model=NAME, weights="sigma", fix=FIXED[NAME], through=told, **options)


def seen(effects, theta_r=(0.0, 70.0, 2.5), wavelength=(500.0, 600.0), directions=None):
    """Values of a surface through an instrument, without noise; 0.2 % is told."""
    made = scene(
        [20.0, 40.0, 60.0],
        {"start": theta_r[0], "stop": theta_r[1], "step": theta_r[2]},
        wavelength=list(wavelength),
        surface={"model": NAME, "parameters": TRUTH},
        effects=effects,
        rtol=1e-7,
    )
    scan = simulate(made)
    return replace(scan, sigma=0.002 * scan.brdf)


def off(fit):
    """Largest distance from the truth, in units of the standard uncertainty."""
    return max(
        float(np.max(np.abs(fit.parameters[name] - value) / fit.sigma[name]))
        for name, value in TRUTH.items()
        if name not in fit.given
    )


@pytest.mark.parametrize(
    ("name", "ratio"), [(NAME, 0.3), (NAME, 1.0), ("abg+lambert", 0.5), ("wang2013", 0.5)]
)
def test_an_aperture_that_biases_points_leaves_no_bias(name, ratio, device):
    row = fit_both_ways(name, ratio, wavelengths=3, repeats=0, device=device)
    assert row.bias_through <= 0.1
    assert row.bias_point > 50.0


def test_an_aperture_that_vanishes_gives_the_fit_of_points(device):
    scan = seen_scan(NAME, 0.0, 3, device)
    point, narrow = fitted(scan, "point"), fitted(scan, through(aperture={"angle": 1e-4}))
    assert narrow.through is not None
    assert narrow.observation.is_points
    for name in point.parameters:
        np.testing.assert_allclose(narrow.parameters[name], point.parameters[name], rtol=1e-9)


@pytest.mark.parametrize(
    "effects",
    [
        {"beam": {"angle": 2.0}},
        {"beam": {"angle": 2.0, "focussed": True}},
        {"beam": {"angle": 1.0}, "aperture": {"angle": 2.0}},
        {"footprint": {"beam": 8.0, "field": 10.0}},
        {"misalignment": {"tilt": 0.5, "height": 0.5, "stage_i": 0.0, "stage_r": 0.0}},
        {"aperture": {"angle": 2.0}, "misalignment": {"tilt": 0.5, "stage_i": 0.0, "stage_r": 0.0}},
    ],
    ids=lambda effects: " ".join(effects),
)
def test_what_a_scene_puts_in_a_fit_takes_out(effects, device):
    scan = seen(effects)
    assert off(fitted(scan, "point")) > 3.0
    found = fitted(scan, through(**effects))
    assert off(found) <= 0.1
    # What is compared with the data is what the detector sees; the noise is 0.2 % and not there.
    np.testing.assert_allclose(found.observed(), scan.brdf, rtol=2e-4)
    np.testing.assert_allclose(found.predict_seen(scan), scan.brdf, rtol=2e-4)
    # And what it tells of itself is the same.
    own = fitted(scan, "scan")
    assert own.through.source == "the scan file"
    np.testing.assert_allclose(own.vector, found.vector, rtol=1e-9)


def test_a_scan_that_tells_of_its_aperture_is_fitted_through_it(device):
    scan = seen({"aperture": {"angle": 3.0}})
    assert scan.solid_angle is not None
    own, told = fitted(scan, "scan"), fitted(scan, through(aperture={"angle": 3.0}))
    assert own.through is not None
    assert own.through.source == "the scan file"
    np.testing.assert_allclose(own.vector, told.vector, rtol=1e-9)
    assert fitted(scan, "point").through is None
    assert off(own) <= 0.1
    # Directions whose aperture is not known are points.
    some = scan.solid_angle.copy()
    some[::2] = np.nan
    half = fitted(replace(scan, solid_angle=some), "scan")
    assert half.through is not None
    assert (half.through.levels[::2] == 0).all()
    assert half.through.angle[1::2] == pytest.approx(3.0, rel=1e-12)


def test_the_file_keeps_what_was_looked_through(tmp_path, device):
    scan = seen({"beam": {"angle": 1.0}, "aperture": {"angle": 2.0}})
    told = through(
        beam={"angle": 1.0}, aperture={"diameter": 20.0, "distance": 10.0 / np.tan(np.deg2rad(1.0))}
    )
    assert told.aperture.angle == pytest.approx(2.0, rel=1e-12)
    fit = fitted(scan, told)
    fit.save(tmp_path / "fit.h5")
    again = Fit.open(tmp_path / "fit.h5")
    assert again.through.instrument == told
    assert again.through.source == "the call"
    np.testing.assert_array_equal(again.through.levels, fit.through.levels)
    np.testing.assert_array_equal(again.observed(), fit.observed())


def test_the_check_is_of_what_the_detector_sees(device):
    fit = fitted(seen({"aperture": {"angle": 2.0}}, (0.0, 70.0, 5.0)), through(aperture={"angle": 2.0}))
    (verdict,) = check_fit(fit, [0], effort=0.1)
    assert verdict.word == "agreed"
    assert verdict.objective == pytest.approx(fit.objective[0], rel=1e-9)


def test_shared_and_smooth_parameters_are_seen_through_it_too(device):
    scan = seen({"aperture": {"angle": 2.5}}, wavelength=np.linspace(500.0, 600.0, 6))
    told = through(aperture={"angle": 2.5})
    common = fitted(scan, told, shared=["ggx.alpha"])
    assert np.ptp(common.parameters["ggx.alpha"]) == 0.0
    assert off(common) <= 0.1
    # Smooth fits take the noise from residuals, of which there are none: shares of the values instead.
    tied, point = fitted(scan, told, smooth=0.01), fitted(scan, "point", smooth=0.01)
    for name in ("ggx.alpha", "ggx.F0", "lambert.rho"):
        np.testing.assert_allclose(tied.parameters[name], TRUTH[name], rtol=2e-4)
    assert (np.abs(point.parameters["ggx.alpha"] / TRUTH["ggx.alpha"] - 1.0) > 0.02).all()


def test_the_half_width_is_that_of_the_lobe():
    """Of GGX: D falls to half where tan²θh = α² (√2 − 1); the other factors move it by some percent."""
    expected = 2.0 * np.rad2deg(np.arctan(0.03 * np.sqrt(np.sqrt(2.0) - 1.0)))
    assert half_width(NAME) == pytest.approx(expected, rel=0.05)
    assert bias(fitted(seen_scan(NAME, 0.0, 2), "point"), NAME) < 1e-3


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (through(aperture={"angle": 40.0}), "aperture of 40° about θr = 70° reaches below the horizon"),
        (7, "through is 7; give an instrument file"),
    ],
)
def test_what_cannot_be_looked_through(told, words, device):
    with pytest.raises(InputError, match=words):
        fitted(seen({}), told)

"""Scene files: what they may say, and what is said of mistakes; surfaces from files."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.fit import AnnealSettings, fit
from clbrdf.scene import load_scene, simulate
from clbrdf.scene.curve import Curve
from tests.reference import naive
from tests.scene.scenes import scene

GOOD = """
[surface]
parameters = { ks = 100 }

[directions]
theta_i = [30, 45]
theta_r = { start = 0, stop = 80, step = 20 }
phi_r = 180

[wavelength]
start = 400
stop = 700
step = 100
"""


@pytest.fixture
def write(tmp_path):
    def text(content):
        path = tmp_path / "scene.toml"
        path.write_text(content, encoding="utf-8")
        return path

    return text


def test_a_scene_without_effects(write):
    made = load_scene(write(GOOD))
    assert made.effects.on() == ()
    assert made.wavelength == (400, 500, 600, 700)
    scan = simulate(made)
    foil = [*naive.TIN_FOIL[:4], 100.0, naive.TIN_FOIL[5]]
    expected = naive.brdf(foil, scan.theta_i, scan.theta_r, scan.phi)
    np.testing.assert_allclose(scan.brdf, expected[:, None] * np.ones(4), rtol=1e-8)
    assert scan.sigma is None


def test_switches(write):
    made = load_scene(write(GOOD + "[effects]\naperture = true\nbeam = false\nreader = {}\n"))
    assert made.effects.on() == ("aperture", "reader")
    assert made.effects.reader.percent == 4.84


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (2, [2, 2, 2]),
        ([[400, 1], [600, 3]], [1, 2, 3]),
        ([[500, 7]], [7, 7, 7]),
        ({"polynomial": [1, 2, 3], "centre": 500, "scale": 100}, [2, 1, 6]),
    ],
)
def test_curves(value, expected):
    np.testing.assert_allclose(Curve.model_validate(value).at(np.array([400.0, 500.0, 600.0])), expected)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[surface]", "[surfaces]"), "surface is missing; add it"),
        (("ks = 100", "kx = 100"), "no parameter 'kx'; it has a, b, c, d, ks, kd"),
        (("ks = 100", "ks = true"), "surface.parameters.ks: give a number, pairs [nm, value], or"),
        (("ks = 100", "ks = [[500, 1], [400, 2]]"), "increasing wavelengths"),
        (("ks = 100", "ks = { polynomial = [1], center = 2 }"), "parameters.ks.center; did you mean centre?"),
        (("[surface]", "[surface]\nmodel = 'phong'"), "no model is called 'phong'; there are abg"),
        (("[surface]", "[surface]\nterms = ['lobe']"), "'lobe'; there are specular, fresnel, attenuation"),
        (("[surface]", "[surface]\nfile = 'x.h5'"), "file and parameters both say what the surface is"),
        (("[surface]", "precision = 'half'\n[surface]"), "no precision is called 'half'; there are fast"),
        (("[surface]", "seed = -1\n[surface]"), "seed = -1: should be greater than or equal to 0"),
        (("[surface]", "rtol = 0\n[surface]"), "rtol = 0: should be greater than or equal to"),
        (("[30, 45]", "[30, 95]"), "theta_i: 95°; zenith angles lie in [0°, 90°)"),
        (("[30, 45]", "[]"), "the scene has no points"),
        (("phi_r = 180", "phi_r = 20"), "phi_r - phi_i = 20° is out of plane"),
        (("start = 400", "start = 800"), "from 800 to 700 is empty in steps of 100"),
        (("start = 400", "start = -400"), "they are positive and increase"),
        (("step = 100", ""), "a range has the keys start, stop and step"),
        (("[wavelength]", "[effects]\napertur = true\n[wavelength]"), "unknown key effects.apertur; did you"),
        (("[wavelength]", "[effects]\nglare = true\n[wavelength]"), "unknown key effects.glare; known here"),
        (("[wavelength]", "[effects]\naperture = 2\n[wavelength]"), "2 does not switch an effect on; give"),
        (("[wavelength]", "[effects]\naperture = { angle = -1 }\n[wavelength]"), "angle = -1: should be"),
        (("[wavelength]", "[effects]\nreader = { each = 'page' }\n[wavelength]"), "'value', 'direction' or"),
        (("[wavelength]", "[detector]\nbias = 2e4\n[wavelength]"), "leaves no room below full_scale"),
    ],
)  # fmt: skip
def test_mistakes(write, change, words):
    with pytest.raises(InputError) as told:
        load_scene(write(GOOD.replace(*change, 1)))
    assert words in str(told.value)
    assert "scene.toml" in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"theta_r": 89.8, "effects": {"aperture": True}}, "about θr = 89.8° reaches below the horizon"),
        ({"theta_i": 89.9, "effects": {"beam": True}}, "about θi = 89.9° reaches below the horizon"),
        ({"surface": {"parameters": {"kd": -1}}}, "surface.parameters: parameter kd is -1"),
        ({"surface": {"terms": []}}, "leaves nothing that reflects"),
        ({"surface": {"file": "no.h5"}}, "no.h5: no such file"),
    ],
)
def test_what_cannot_be_simulated(more, words):
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        simulate(scene(**more))


class TestSurfacesFromFiles:
    def test_a_fit(self, small_scan, tmp_path):
        result = fit(small_scan, weights="relative", settings=AnnealSettings(chains=16, levels=8))
        result.save(tmp_path / "fit.h5")
        made = scene([30, 45], [10, 44, 70], [450, 500, 650], surface={"file": str(tmp_path / "fit.h5")})
        scan = simulate(made)
        columns = [np.interp(scan.wavelength, result.wavelength, v) for v in result.parameters.values()]
        for k, p in enumerate(zip(*columns, strict=True)):
            expected = naive.brdf(p, scan.theta_i, scan.theta_r, scan.phi)
            np.testing.assert_allclose(scan.brdf[:, k], expected, rtol=1e-8)
        with pytest.raises(InputError, match=r"from 450 to 650 nm; stay within it"):
            simulate(made.model_copy(update={"wavelength": (440.0, 500.0)}))

    def test_terms_of_a_fit(self, small_scan, tmp_path):
        result = fit(small_scan, weights="relative", settings=AnnealSettings(chains=16, levels=8))
        result.save(tmp_path / "fit.h5")
        surface = {"file": str(tmp_path / "fit.h5"), "terms": ["diffuse"]}
        scan = simulate(scene(30, [0, 40], [450, 650], surface=surface))
        kd = result.parameters["kd"][[0, 2]]
        np.testing.assert_allclose(scan.brdf, np.tile(kd / np.pi, (2, 1)), rtol=1e-14)

    def test_a_scan(self, small_scan, tmp_path):
        small_scan.save(tmp_path / "scan.h5")
        surface = {"file": str(tmp_path / "scan.h5")}
        scan = simulate(scene([30, 60], [0, 26, 74], [450, 500], surface=surface))
        measured = Scan.open(tmp_path / "scan.h5")
        for n, (i, r) in enumerate(zip(scan.theta_i, scan.theta_r, strict=True)):
            row = np.argmin(np.hypot(measured.theta_i - i, measured.theta_r - r))
            expected = np.interp([450, 500], measured.wavelength, measured.brdf[row])
            np.testing.assert_allclose(scan.brdf[n], expected, rtol=1e-14)

    def test_an_aperture_over_a_scan(self, small_scan, tmp_path):
        """The cone lies within what is nearest to one measured direction: Ω-mean of a constant BRDF."""
        small_scan.save(tmp_path / "scan.h5")
        made = scene(
            30, 40, [450, 550], surface={"file": str(tmp_path / "scan.h5")},
            effects={"aperture": {"angle": 2.0}, "bandwidth": {"width": 3.0}},
        )  # fmt: skip
        row = np.argmin(np.hypot(small_scan.theta_i - 30, small_scan.theta_r - 40))
        # Straight lines between 450 and 550 nm: the slit changes nothing at 550 beyond 0.1 · (3/100)/6 of it.
        expected = small_scan.brdf[row, :2] * (1 + np.cos(np.deg2rad(1.0))) / 2
        np.testing.assert_allclose(simulate(made).brdf[0], expected, rtol=1e-3)

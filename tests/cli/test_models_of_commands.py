"""Commands with any model: fixed and shared parameters, evaluate, simulate; and mistakes made with them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clbrdf import Fit, Scan
from tests.cli.test_commands import assert_one_line
from tests.fit.test_shared import made
from tests.reference.models import REFERENCES


@pytest.fixture
def scan_file(tmp_path):
    made(3, sigma=True).save(tmp_path / "scan.h5")
    return tmp_path / "scan.h5"


@pytest.fixture
def spectrum(tmp_path):
    path = tmp_path / "n.csv"
    path.write_text("wavelength_nm,n\n# glass\n500,1.6\n\n390,1.5\n", encoding="utf-8")
    return path


def test_a_sum_with_a_shared_and_a_fixed_parameter(run, scan_file, tmp_path):
    words = ("--model", "ggx+lambert", "--shared", "alpha", "--fix", "F90=0.9", "--weights", "sigma")
    status, out, err = run(
        "fit", scan_file, "-o", tmp_path / "fit.h5", *words, "--json", tmp_path / "fit.json"
    )
    assert (status, err) == (0, "")
    fit = Fit.open(tmp_path / "fit.h5")
    value, sigma = fit.parameters["ggx.alpha"][0], fit.sigma["ggx.alpha"][0]
    assert f"ggx.alpha = {value:.5g} ± {sigma:.2g}, one number for all wavelengths" in out
    assert "ggx.F90 = 0.9" in out
    assert abs(value - 0.15) < 4.0 * sigma
    told = json.loads((tmp_path / "fit.json").read_text())
    assert told["shared"] == ["ggx.alpha"]
    assert told["given"] == ["ggx.F90"]
    assert "--shared alpha" in fit.provenance["command"]
    assert "--fix F90=0.9" in fit.provenance["command"]
    assert max(len(line) for line in out.splitlines()) <= 100
    status, again, _ = run("info", tmp_path / "fit.h5")
    assert status == 0
    assert "one number for all wavelengths" in again


def test_a_spectrum_is_interpolated(run, scan_file, spectrum, tmp_path):
    words = ("--model", "ggx_dielectric+lambert", "--fix", f"n={spectrum}")
    status, out, _ = run("fit", scan_file, "-o", tmp_path / "fit.h5", *words)
    assert status == 0
    fit = Fit.open(tmp_path / "fit.h5")
    expected = 1.5 + 0.1 * (fit.wavelength - 390.0) / 110.0
    np.testing.assert_allclose(fit.parameters["ggx_dielectric.n"], expected, rtol=1e-12)
    assert fit.given == ("ggx_dielectric.n",)
    assert "ggx_dielectric.n, a spectrum" in out
    assert str(spectrum.parent) not in fit.provenance["command"]
    assert "spectrum_0_sha256" in fit.provenance


def test_whole_surfaces_add_up_by_force_and_are_opened_again(run, scan_file, tmp_path):
    made(1).save(scan_file, overwrite=True)
    words = ("fit", scan_file, "-o", tmp_path / "fit.h5", "--model", "hapke+rpv")
    assert_one_line(run(*words), "adds up whole surfaces (hapke, rpv)", "--force")
    status, _, _ = run(*words, "--force")
    assert status == 0
    assert Fit.open(tmp_path / "fit.h5").model.name == "hapke+rpv"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--model", "mirror"), ("no model is called 'mirror'; there are abg,",)),
        (("--model", "ggx+mirror"), ("no model is called 'mirror'",)),
        (("--model", "ggx", "--fix", "n=1.5"), ("model ggx has no parameter 'n'; it has alpha, F0, F90",)),
        (("--model", "ggx", "--fix", "alpha"), ("write name=number or name=FILE.csv",)),
        (("--model", "ggx", "--fix", "F0=0.1", "--fix", "F0=0.2"), ("F0 is given twice",)),
        (("--model", "ggx+lambert", "--fix", "F0=0.1", "--fix", "ggx.F0=0.2"), ("ggx.F0 is given twice",)),
        (("--model", "ggx", "--fix", "alpha=-1"), ("fixed alpha is -1; it has to be above 0",)),
        (("--model", "ggx", "--fix", "alpha=nan"), ("fixed alpha is not finite",)),
        (("--model", "lambert", "--fix", "rho=0.1"), ("all parameters of model lambert are fixed",)),
        (("--model", "rayleigh_rice"), ("needs n (", " and k (", "--fix n=VALUE")),
        (("--model", "ggx+ggx", "--shared", "alpha"), ("'alpha' may be ggx1.alpha or ggx2.alpha",)),
        (("--model", "ggx", "--shared", "beta"), ("has no parameter 'beta'",)),
        (("--model", "ggx", "--shared", "alpha", "--smooth", "0.1"), ("both tie wavelengths",)),
        (("--model", "ggx", "--method", "dictionary"), ("needs a dictionary of lobes",)),
        (("--model", "eon", "--method", "anneal-separable"), ("needs linear parameters",)),
    ],
)
def test_mistakes_of_a_fit(run, scan_file, tmp_path, words, said):
    assert_one_line(run("fit", scan_file, "-o", tmp_path / "fit.h5", *words), *said)
    assert not (tmp_path / "fit.h5").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "no such file"),
        ("410,1.5\n800,1.6\n", "runs from 410 to 800 nm and does not cover the scan's 400 to 410 nm"),
        ("390|1.5\n800|1.6\n", "line 1: '390|1.5' is not a wavelength in nm and a value"),
        ("nm,n\n390,1.5\n800,glass\n", "line 3: '800,glass' is not"),
        ("390,1.5\n390,1.6\n", "line 2: 390 nm is given twice"),
        ("", "is empty"),
        ("# nothing but a remark\n", "holds no values"),
        ("nm,n,k\n390,1.5,0.1\n", "line 2: '390,1.5,0.1' is not"),
    ],
)
def test_mistakes_in_a_spectrum(run, scan_file, tmp_path, text, said):
    if text is not None:
        (tmp_path / "n.csv").write_text(text, encoding="utf-8")
    words = ("--model", "ggx_dielectric", "--fix", f"n={tmp_path / 'n.csv'}")
    assert_one_line(run("fit", scan_file, "-o", tmp_path / "fit.h5", *words), "n.csv", said)


class TestEvaluate:
    ANGLES = ("--theta-i", "30", "--theta-r", "30,40", "--phi", "150")

    def values(self, run, tmp_path, *words):
        path = tmp_path / "values.json"
        status, out, err = run("evaluate", *self.ANGLES, *words, "--json", path, "--overwrite")
        assert (status, err) == (0, "")
        return json.loads(path.read_text())["brdf"], out

    def exact(self, name, given, phi_i=0.0, wavelength=None):
        value = REFERENCES[name].value
        return [float(value(given, 30.0, phi_i, r, phi_i + 150.0, wavelength)) for r in (30.0, 40.0)]

    def test_a_model_by_name(self, run, tmp_path):
        values, _ = self.values(run, tmp_path, "--model", "ggx", "--param", "alpha=0.1")
        np.testing.assert_allclose(
            values, self.exact("ggx", {"alpha": 0.1, "F0": 0.05, "F90": 1.0}), rtol=1e-11
        )

    def test_short_names_in_a_sum(self, run, tmp_path):
        values, _ = self.values(run, tmp_path, "--model", "ggx+lambert", "--param", "alpha=0.1,rho=0.2")
        exact = np.add(self.exact("ggx", {"alpha": 0.1, "F0": 0.05, "F90": 1.0}), 0.2 / np.pi)
        np.testing.assert_allclose(values, exact, rtol=1e-11)

    def test_incident_azimuths_of_an_anisotropic_model(self, run, tmp_path):
        words = ("--model", "ward_anisotropic", "--param", "rho_s=0.3,alpha_x=0.1,alpha_y=0.3")
        for azimuth in (0.0, 40.0):
            values, out = self.values(run, tmp_path, *words, "--phi-i", azimuth)
            given = {"rho_s": 0.3, "alpha_x": 0.1, "alpha_y": 0.3}
            np.testing.assert_allclose(values, self.exact("ward_anisotropic", given, azimuth), rtol=1e-11)
            assert "φi (°)" in out

    def test_the_wavelength_where_a_model_needs_it(self, run, tmp_path):
        given = {"A": 1e-5, "B": 10.0, "C": 3.0, "n": 1.5, "k": 0.1}
        words = ("--model", "rayleigh_rice", "--param", "n=1.5,k=0.1")
        values, _ = self.values(run, tmp_path, *words, "--wavelength", 500)
        np.testing.assert_allclose(values, self.exact("rayleigh_rice", given, wavelength=500.0), rtol=1e-11)
        assert_one_line(
            run("evaluate", *self.ANGLES, *words), "depends on the wavelength itself; give wavelength in nm"
        )

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("--model", "ggx", "--wavelength", "-5"), "wavelength is -5 nm; it has to be above 0"),
            (("--model", "ggx", "--phi-i", "north"), "--phi-i: 'north' is neither a number"),
            (("--model", "ggx+ggx", "--param", "alpha=0.1"), "'alpha' may be ggx1.alpha or ggx2.alpha"),
            (("--model", "rayleigh_rice", "--wavelength", "500"), "needs n (refractive index"),
            (("--model", "hapke+rpv"), "adds up whole surfaces"),
            (
                ("--model", "rayleigh_rice", "--param", "wavelength=500", "--wavelength", "500"),
                "the wavelength is given twice",
            ),
        ],
    )
    def test_mistakes(self, run, words, said):
        assert_one_line(run("evaluate", *self.ANGLES, *words), said)


def test_a_scene_takes_any_model(run, tmp_path):
    (tmp_path / "scene.toml").write_text(
        '[surface]\nmodel = "ggx+minnaert"\nparameters = { alpha = 0.2, "minnaert.k" = 0.8 }\n'
        "[directions]\ntheta_i = [30]\ntheta_r = [20, 30]\nphi_r = 180\n"
        "[wavelength]\nstart = 400\nstop = 500\nstep = 100\n",
        encoding="utf-8",
    )
    status, _, err = run("simulate", tmp_path / "scene.toml", "-o", tmp_path / "made.h5")
    assert (status, err) == (0, "")
    expected = [
        float(REFERENCES["ggx"].value({"alpha": 0.2, "F0": 0.05, "F90": 1.0}, 30.0, 0.0, r, 180.0))
        + float(REFERENCES["minnaert"].value({"rho": rho, "k": 0.8}, 30.0, 0.0, r, 180.0))
        for r, rho in ((20.0, 0.5), (30.0, 0.5))
    ]
    np.testing.assert_allclose(Scan.open(tmp_path / "made.h5").brdf[:, 0], expected, rtol=1e-8)

"""`clbrdf choose`: table, file, JSON, report, and what is said of mistakes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clbrdf import Choice
from tests.choose.made import made

THREE = "lambert,ggx+lambert,beckmann+lambert"


@pytest.fixture(scope="module")
def scan_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("choose") / "scan.h5"
    made().save(path)
    return path


def test_a_choice_is_printed_written_and_shown_again(run, scan_file, tmp_path):
    words = ("--models", THREE, "-o", tmp_path / "fit.h5", "--json", tmp_path / "fit.json")
    status, out, err = run("choose", scan_file, *words)
    assert (status, err) == (0, "")
    assert max(len(line) for line in out.splitlines()) <= 100
    assert "> ggx+lambert" in out
    assert "ggx+lambert predicts best" in out
    assert "weights sigma" in out
    told = json.loads((tmp_path / "fit.json").read_text())
    assert told["chosen"] == "ggx+lambert"
    assert told["ranking"][0]["model"] == "ggx+lambert"
    assert np.shape(told["ranking"][0]["score"]) == (4, 2)
    kept = Choice.open(tmp_path / "fit.h5")
    assert kept.fit.provenance["command"].startswith("clbrdf choose scan.h5 --models lambert,ggx+lambert")
    assert "input_0_sha256" in kept.fit.provenance
    assert kept.fit.provenance["weights"] == "sigma"
    status, out, _ = run("info", tmp_path / "fit.h5")
    assert status == 0
    assert "> ggx+lambert" in out


def test_a_usual_fit_shows_no_ranking(run, scan_file, tmp_path):
    run("fit", scan_file, "--model", "lambert", "-o", tmp_path / "fit.h5")
    _, out, _ = run("info", tmp_path / "fit.h5")
    assert "models by what they predict" not in out


def test_no_model_fits_is_said(run, tmp_path):
    bent = made(factor=lambda theta_i, signed: 1.0 + 0.15 * np.cos(np.deg2rad(4.0 * signed)))
    bent.save(tmp_path / "scan.h5")
    status, out, _ = run("choose", tmp_path / "scan.h5", "--models", THREE, "-o", tmp_path / "fit.h5")
    assert status == 0
    assert "No model fits: even the best leaves a reduced chi-squared of" in out
    assert "misses most:" in out


def test_skipped_models_are_listed(run, scan_file, tmp_path):
    words = ("--models", "lambert,ggx_anisotropic,rayleigh_rice", "-o", tmp_path / "fit.h5")
    status, out, _ = run("choose", scan_file, *words)
    assert status == 0
    assert "not compared" in out
    assert "the sample was not turned" in out
    assert "rayleigh_rice" in out


def test_a_fixed_spectrum_holds_in_every_model_that_has_it(run, scan_file, tmp_path):
    (tmp_path / "n.csv").write_text("wavelength_nm,n\n300,1.4\n900,1.7\n")
    words = ("--models", "ggx_dielectric+lambert,lambert", "--fix", f"n={tmp_path / 'n.csv'}")
    status, _, err = run("choose", scan_file, *words, "-o", tmp_path / "fit.h5")
    assert (status, err) == (0, "")
    fit = Choice.open(tmp_path / "fit.h5").fit
    expected = 1.4 + 0.3 * (fit.wavelength - 300.0) / 600.0
    np.testing.assert_allclose(fit.parameters["ggx_dielectric.n"], expected, rtol=1e-12)
    assert fit.given == ("ggx_dielectric.n",)
    assert "--fix n=n.csv" in fit.provenance["command"]
    assert "spectrum_0_sha256" in fit.provenance


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--models", "lambert,nonesuch"), "no model is called 'nonesuch'"),
        (("--models", "hapke+rpv"), "adds up whole surfaces (hapke, rpv); take one of them, or --force"),
        (("--models", "lambert", "--weights", "none.csv"), "none.csv"),
        (("--models", "lambert", "--fix", "rho"), "--fix 'rho': write name=number or name=FILE.csv"),
        (("--models", "lambert", "--fix", "rho=nowhere.csv"), "nowhere.csv"),
        (("--models", "lambert", "--fix", "n=1.5"), "none of the models has a parameter 'n' to fix: lambert"),
        (("--models", "lambert", "--wavelengths", "few"), "--wavelengths 'few': give a whole number"),
        (("--models", "lambert", "--json", "{out}"), "is another file of this command"),
        (("--models", "rayleigh_rice"), "no model is left to compare"),
    ],
)
def test_mistakes_end_in_one_line_and_no_file(run, scan_file, tmp_path, words, message):
    out = tmp_path / "fit.h5"
    status, printed, err = run("choose", scan_file, "-o", out, *(w.format(out=out) for w in words))
    assert (status, printed) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_two_incident_angles_are_refused(run, tmp_path):
    scan = made()
    scan.rows(scan.theta_i < 50.0).save(tmp_path / "scan.h5")
    status, _, err = run("choose", tmp_path / "scan.h5", "-o", tmp_path / "fit.h5")
    assert status == 2
    assert "2 incident angles" in err
    assert "fit one model with 'clbrdf fit'" in err


def test_an_existing_report_is_told_before_the_work(run, scan_file, tmp_path):
    (tmp_path / "report").mkdir()
    (tmp_path / "report" / "report.html").write_text("mine")
    words = ("--models", "lambert", "-o", tmp_path / "fit.h5", "--report", tmp_path / "report")
    status, _, err = run("choose", scan_file, *words)
    assert status == 2
    assert "report.html: exists already" in err
    assert not (tmp_path / "fit.h5").exists()


def test_an_existing_file_is_kept(run, scan_file, tmp_path):
    (tmp_path / "fit.h5").write_text("mine")
    status, _, err = run("choose", scan_file, "-o", tmp_path / "fit.h5")
    assert status == 2
    assert "exists already" in err
    assert (tmp_path / "fit.h5").read_text() == "mine"

"""`clbrdf fit --through`: what is said of the instrument, and what of mistakes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Fit
from clbrdf.cli import main
from clbrdf.scene import simulate
from tests.scene.scenes import scene

TRUTH = {"ggx.alpha": 0.1, "ggx.F0": 0.1, "ggx.F90": 1.0, "lambert.rho": 0.3}
FIT = ("--model", "ggx+lambert", "--fix", "ggx.F90=1", "--weights", "sigma")


@pytest.fixture(scope="module")
def scan_file(tmp_path_factory):
    made = scene(
        [20.0, 50.0],
        {"start": 0.0, "stop": 70.0, "step": 5.0},
        wavelength=[500.0, 510.0],
        surface={"model": "ggx+lambert", "parameters": TRUTH},
        effects={"aperture": {"angle": 5.0}},
    )
    scan = simulate(made)
    path = tmp_path_factory.mktemp("through") / "scan.h5"
    replace(scan, sigma=0.002 * scan.brdf).save(path)
    return path


def run(capsys, *words):
    status = main([str(word) for word in words])
    told = capsys.readouterr()
    return status, told.out, told.err


def test_the_summary_says_what_was_looked_through(scan_file, tmp_path, capsys):
    status, out, _ = run(capsys, "fit", scan_file, "-o", tmp_path / "own.h5", *FIT)
    assert status == 0
    assert "aperture 5°, as the scan file says" in out
    assert "aperture: of 30 directions" in out
    status, out, _ = run(capsys, "fit", scan_file, "-o", tmp_path / "point.h5", *FIT, "--point")
    assert "points; the aperture that the scan tells of is left out" in out
    (tmp_path / "instrument.toml").write_text("[aperture]\nangle = 5.0\n")
    told = ("--through", tmp_path / "instrument.toml")
    status, out, _ = run(capsys, "fit", scan_file, "-o", tmp_path / "told.h5", *FIT, *told)
    assert "aperture 5°, as instrument.toml says" in out
    own, named = Fit.open(tmp_path / "own.h5"), Fit.open(tmp_path / "told.h5")
    np.testing.assert_allclose(own.vector, named.vector, rtol=1e-9)
    assert "--through instrument.toml" in named.provenance["command"]
    assert len(named.provenance["through_sha256"]) == 64


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no geometry in it; name an effect"),
        ("[aperture]\nangle = 40\n", "aperture of 40° about θr = 70° reaches below the horizon; leave out"),
        ("[bandwidth]\nwidth = 20\n", "bandwidth ties neighbouring wavelengths; add --smooth 0.01"),
        ("[apertur]\nangle = 1\n", "unknown key apertur; did you mean aperture?"),
        ("[aperture]\nangle = 1\ndistance = 3\n", "give angle, or diameter and distance"),
    ],
)
def test_mistakes_in_an_instrument_file(scan_file, tmp_path, capsys, text, words):
    path = tmp_path / "instrument.toml"
    path.write_text(text)
    status, _, err = run(capsys, "fit", scan_file, "-o", tmp_path / "fit.h5", "--through", path)
    assert status == 2
    assert words in err
    assert "instrument.toml" in err
    assert err.count("\n") == 1
    assert not (tmp_path / "fit.h5").exists()


def test_a_bandwidth_finer_than_the_wavelengths(scan_file, tmp_path, capsys):
    path = tmp_path / "instrument.toml"
    path.write_text("[bandwidth]\nwidth = 2.4\n")
    words = ("fit", scan_file, "-o", tmp_path / "fit.h5", "--through", path, "--smooth", "0.01")
    status, _, err = run(capsys, *words)
    assert status == 2
    assert "bandwidth of 2.4 nm is finer than the scan's wavelengths, which are 10 nm apart" in err


def test_a_file_and_points_are_too_much(scan_file, tmp_path, capsys):
    told = ("--through", tmp_path / "instrument.toml", "--point")
    for command in ("fit", "choose"):
        status, _, err = run(capsys, command, scan_file, "-o", tmp_path / "fit.h5", *told)
        assert status == 2
        assert "--point and --through say two things" in err

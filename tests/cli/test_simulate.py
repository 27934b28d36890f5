"""`clbrdf simulate`, and reflectance in `clbrdf info`."""

from __future__ import annotations

import pytest

from clbrdf import Scan
from clbrdf.fit import AnnealSettings, fit
from tests.cli.test_commands import assert_one_line

SCENE = """
sample = "foil"
[surface]
parameters = { ks = { polynomial = [450, 1], centre = 550 } }
[directions]
theta_i = [30, 60]
theta_r = { start = 0, stop = 80, step = 5 }
phi_r = 180
[wavelength]
start = 500
stop = 600
step = 25
[effects]
aperture = { angle = 1 }
saturation = true
shot_noise = true
"""


@pytest.fixture
def scene_file(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    return tmp_path / "scene.toml"


def test_a_scan_of_known_truth(run, scene_file, tmp_path):
    status, out, err = run("simulate", scene_file, "-o", tmp_path / "scan.h5")
    assert (status, err) == (0, "")
    assert "aperture, shot_noise, saturation" in out
    assert "170, 0 of them masked" in out
    scan = Scan.open(tmp_path / "scan.h5")
    assert scan.brdf.shape == (34, 5)
    assert scan.provenance["command"] == "clbrdf simulate scene.toml"
    assert scan.provenance["effects"] == "aperture, shot_noise, saturation"
    status, out, _ = run("info", tmp_path / "scan.h5")
    assert status == 0
    assert "none: simulated with aperture" in out


def test_same_seed_same_bytes(run, scene_file, tmp_path):
    for name, seed in (("a.h5", 1), ("b.h5", 1), ("c.h5", 2)):
        run("simulate", scene_file, "-o", tmp_path / name, "--seed", seed)
    same, again, other = ((tmp_path / name).read_bytes() for name in ("a.h5", "b.h5", "c.h5"))
    assert same == again != other


def test_ledger(run, scene_file):
    status, out, _ = run("simulate", scene_file, "--ledger")
    assert status == 0
    rows = [line.split()[0] for line in out.splitlines() if len(line.split()) == 4]
    assert rows == ["aperture", "shot_noise", "saturation"]
    assert "seconds added" in out
    assert "may be left out where that will do: saturation (0, saves" in out
    assert "aperture costs most" in out
    assert max(len(line) for line in out.splitlines() if "─" in line) <= 100


def test_rtol_says_what_it_does(run, scene_file, tmp_path):
    status, out, _ = run("simulate", scene_file, "--rtol", "0.01", "-o", tmp_path / "scan.h5")
    assert status == 0
    assert "rtol 0.01: left out saturation: it moves the result by 0 at most, on 34 of 34 directions" in out
    assert "rtol 0.01: aperture: integrated to 0.0025, not 0.0001" in out
    assert Scan.open(tmp_path / "scan.h5").provenance["effects"] == "aperture, shot_noise"


def test_check(run, scene_file):
    status, out, _ = run("simulate", scene_file, "--check")
    assert status == 0
    assert "directional-hemispherical reflectance to θr = 85°" in out
    assert "reflects more than it receives" in out
    assert "diverges towards 90°" in out
    assert "not reciprocal" in out


def test_check_of_a_plane_scan(run, small_scan, tmp_path):
    small_scan.save(tmp_path / "measured.h5")
    parameters = "parameters = { ks = { polynomial = [450, 1], centre = 550 } }"
    text = SCENE.replace(parameters, 'file = "measured.h5"')
    (tmp_path / "scene.toml").write_text(text)
    status, out, _ = run("simulate", tmp_path / "scene.toml", "--check")
    assert status == 0
    assert "measured in one plane only" in out
    assert "not reciprocal" in out


def test_info_of_a_fit(run, small_scan, tmp_path):
    fit(small_scan, weights="relative", settings=AnnealSettings(chains=16, levels=8)).save(
        tmp_path / "fit.h5"
    )
    status, out, _ = run("info", tmp_path / "fit.h5")
    assert status == 0
    rows = [line.split() for line in out.splitlines()]
    at_60 = next(row for row in rows if row[:1] == ["60"] and len(row) == 5)
    # Table 1 times 0.9 and 1.1 without noise: 14.9503 of each.
    assert float(at_60[1]) == pytest.approx(0.9 * 14.9503, rel=1e-4)
    assert float(at_60[3]) == pytest.approx(1.1 * 14.9503, rel=1e-4)
    assert "reflects more than it receives" in out
    assert "not reciprocal" in out


def test_mistakes(run, scene_file, tmp_path):
    target = tmp_path / "scan.h5"
    assert_one_line(run("simulate", scene_file), "nothing to do: name a scan file with -o")
    assert_one_line(run("simulate", tmp_path / "no.toml", "-o", target), "no.toml: no such file")
    assert_one_line(run("simulate", scene_file, "-o", scene_file), "is another file of this command")
    assert_one_line(run("simulate", scene_file, "-o", target, "--precision", "half"), "'half'")
    assert_one_line(
        run("simulate", scene_file, "-o", target, "--precision", "single", "--rtol", "0.1"), "give one"
    )
    assert_one_line(run("simulate", scene_file, "-o", target, "--rtol", "0"), "rtol is 0")
    assert_one_line(run("simulate", scene_file, "-o", target, "--seed", "-3"), "--seed is -3")
    assert_one_line(run("simulate", scene_file, "-o", target, "--device", "Abacus"), "'Abacus'")
    scene_file.write_text(SCENE.replace("stop = 80", "stop = 89.6").replace("step = 5", "step = 6.4"))
    assert_one_line(
        run("simulate", scene_file, "-o", target), "scene.toml: effects.aperture", "below the horizon"
    )
    assert not target.exists()

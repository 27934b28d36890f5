"""`clbrdf export` and `clbrdf render` as a user gives them."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

from clbrdf import Fit, Scan, fit
from clbrdf.formats.rgl.format import scan_material
from clbrdf.formats.rgl.tables import read_tables
from clbrdf.formats.rgl.values import TensorReader
from clbrdf.geometry import Directions
from tests.formats.rgl.test_rgl_scans import SURFACE, scan_of


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("materials")
    scan_of(SURFACE, zeniths=9, azimuths=9).save(folder / "scan.h5")
    scan_of(SURFACE, azimuths=2).save(folder / "plane.h5")
    return folder


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    path = tmp_path_factory.mktemp("fits") / "fit.h5"
    fit(scan_of(SURFACE), seed=0).save(path)
    return path


def test_export_of_a_fit_says_what_it_reached(run, fitted, tmp_path):
    out = tmp_path / "f.bsdf"
    status, text, error = run("export", fitted, "-o", out, "--tolerance", "1%")
    assert (status, error) == (0, "")
    for word in (
        "tolerance",
        "1 %",
        "reached, worst wavelength",
        "MB",
        "3, 450–650 nm",
        "θi 3–80°",
        "beyond, 82°",
    ):
        assert word in text
    assert max(len(line) for line in text.splitlines()) <= 100
    reader = TensorReader(read_tables(out))
    result = Fit.open(fitted)
    rng = np.random.default_rng(3)
    angles = rng.uniform(5, 78, 2000), rng.uniform(0, 80, 2000), rng.uniform(0, 360, 2000)
    truth = result.evaluate(Directions.relative(*angles))
    assert (np.abs(reader.brdf(*angles) - truth).sum(axis=0) / truth.sum(axis=0) < 0.02).all()
    again, _, error = run("export", fitted, "-o", out)
    assert again == 2
    assert "exists already" in error


def test_export_rgb_and_some_wavelengths(run, files, tmp_path):
    words = ("-o", tmp_path / "rgb.bsdf", "--false-colour", "650,550,450", "--tolerance", "0.05")
    status, text, _ = run("export", files / "scan.h5", *words)
    assert status == 0
    assert "R, G, B" in text
    assert read_tables(tmp_path / "rgb.bsdf").wavelength is None
    status, _, _ = run(
        "export", files / "scan.h5", "-o", tmp_path / "w.bsdf", "--wavelength", "440,560", "--tolerance", "5%"
    )
    assert status == 0
    assert read_tables(tmp_path / "w.bsdf").wavelength.tolist() == [450.0, 550.0]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--tolerance", "tiny"], "--tolerance 'tiny' is no positive number; write 0.5% or 0.005"),
        (["--tolerance", "0"], "--tolerance '0' is no positive number"),
        (["--wavelength", "blue"], "--wavelength: 'blue' is neither a number nor"),
        (["--rgb", "--illuminant", "D60"], "illuminant 'D60' is not known"),
        (["--rgb"], "a colour needs a spectrum from 460 to 620 nm in steps of at most 60 nm"),
        (["--illuminant", "A"], "--illuminant says what light --rgb is for"),
        (["--side", "transmission"], "an rgl file holds reflection only"),
        (["--phi-i", "45"], "no incident azimuth of 45°; it has 0"),
        (["--format", "ssdd", "--rgb"], "--rgb is for rgl files, and this is to be ssdd"),
        (["--rgb", "--false-colour", "650,550,450"], "--rgb and --false-colour both choose"),
    ],
)
def test_mistakes_in_an_export(run, files, tmp_path, words, message):
    status, out, error = run("export", files / "scan.h5", "-o", tmp_path / "x.bsdf", *words)
    assert (status, out) == (2, "")
    assert message in error
    assert len(error.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_scan_in_plane_is_not_interpolated(run, files, tmp_path):
    status, _, error = run("export", files / "plane.h5", "-o", tmp_path / "x.bsdf")
    assert status == 2
    assert "plane.h5: the scan was measured in the plane of incidence only" in error
    assert "fit a model (clbrdf fit)" in error


def test_hemispheres_of_black_coatings(run, coatings, tmp_path):
    path = coatings / "black_coatings_hemisphere_650nm.csv"
    assert run("import", path, "--sample", "AnoBlackEC1onAlum", "-o", tmp_path / "b.h5")[0] == 0
    material, _ = scan_material(Scan.open(tmp_path / "b.h5"))
    rng = np.random.default_rng(1)
    angles = rng.uniform(10, 70, 500), rng.uniform(0, 80, 500), rng.uniform(0, 360, 500)
    value = material.brdf(*angles, np.arange(1))
    assert np.isfinite(value).all()
    # What was measured spans 0.0055 to 1.8 1/sr.
    assert 0.005 < value.min() < value.max() < 2.0


def test_render_without_mitsuba(run, files, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    status, out, error = run("render", files / "scan.h5", "-o", tmp_path / "x.png")
    assert (status, out) == (2, "")
    assert error == "clbrdf: pictures need Mitsuba; install it with: pip install 'clbrdf[render]'\n"


def test_render_beside_another(run, files, fitted, tmp_path):
    pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    words = ("--false-colour", "650,550,450", "--samples", 16, "--width", 160, "--tolerance", "5%")
    status, out, error = run(
        "render", files / "scan.h5", "-o", tmp_path / "x.png", "--compare", fitted, *words
    )
    assert status == 0, error
    assert out == f"wrote {tmp_path / 'x.png'}\n"
    assert "650, 550, 450 nm shown as red, green, blue" in error
    pixels = np.asarray(Image.open(tmp_path / "x.png"))
    assert pixels.shape == (124, 324, 3)
    # One is a fit to the other, with a model that is not its own: alike, not the same.
    left, right = pixels[:100, :160].astype(float), pixels[:100, 164:].astype(float)
    assert np.abs(left - right).mean() < 20.0
    assert left.std() > 12.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--width", "20"], "--width 20: give 100 to 4000 pixels"),
        (["--samples", "0"], "--samples 0: give 1 to 4096"),
        (["--exposure", "50"], "--exposure 50: give -20 to 20 stops"),
        (["--false-colour", "650,550"], "3 wavelengths, for red, green and blue; 2 are given"),
        ([], "give three of them as --false-colour R,G,B"),
    ],
)
def test_mistakes_in_a_picture(run, files, tmp_path, words, message):
    pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    status, out, error = run("render", files / "scan.h5", "-o", tmp_path / "x.png", *words)
    assert (status, out) == (2, "")
    assert message in error
    assert len(error.splitlines()) == 1
    assert not list(tmp_path.iterdir())

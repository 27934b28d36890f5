"""`clbrdf view` and `clbrdf report`, with the mistakes people make."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from clbrdf import Scan
from tests.cli.test_commands import assert_one_line
from tests.viz.conftest import FOIL, all_masked, fit_of, gl  # noqa: F401 (a fixture)

pytestmark = pytest.mark.usefixtures("gl")


@pytest.fixture
def fit_file(small_scan, tmp_path):
    fit_of(small_scan, FOIL).save(tmp_path / "fit.h5")
    return tmp_path / "fit.h5"


@pytest.fixture
def scan_file(small_scan, tmp_path):
    small_scan.save(tmp_path / "scan.h5")
    return tmp_path / "scan.h5"


def test_pictures_of_a_fit(run, fit_file, tmp_path):
    png, gif = tmp_path / "a.png", tmp_path / "a.gif"
    result = run("view", fit_file, "--png", png, "--gif", gif, "--size", "400x300", "--theta-i", "30,45,60")
    assert result[0] == 0
    assert "a.gif: 3 stops" in result[2]
    with Image.open(png) as picture:
        assert picture.size == (400, 300)
    assert run("view", fit_file, "--png", png, "--overwrite", "--size", "400x300")[0] == 0


@pytest.mark.parametrize(
    "words",
    [
        ("--overlay", "--theta-i", "30,60", "--radius", "log"),
        ("--difference",),
        ("--radius", "cosine", "--wavelength", "450,650"),
        ("--no-points", "--transparent", "--radius", "log", "--floor", "0.01"),
    ],
)
def test_ways_to_look(run, fit_file, tmp_path, words):
    assert run("view", fit_file, "--png", tmp_path / "a.png", "--size", "400x300", *words)[0] == 0


def test_a_scan_and_its_fit_side_by_side_and_their_difference(run, scan_file, fit_file, tmp_path):
    for k, words in enumerate([(), ("--difference",), ("--overlay",)]):
        out = tmp_path / f"{k}.png"
        assert run("view", scan_file, fit_file, "--png", out, "--size", "400x300", *words)[0] == 0
        assert out.is_file()


def test_page_and_report(run, fit_file, scan_file, tmp_path):
    start = ("--wavelength", "650", "--theta-i", "50", "--radius", "log")
    result = run("view", fit_file, "--html", tmp_path / "a.html", *start)
    assert result[0] == 0
    assert "a.html, 0." in result[2]
    assert "nm=650.0&theta_i=50.0&theta_r=50.0&scale=log" in (tmp_path / "a.html").read_text()
    assert run("report", fit_file, scan_file, "-o", tmp_path / "b.html")[0] == 0
    assert (tmp_path / "b.html").is_file()
    assert_one_line(run("report", fit_file, "-o", tmp_path / "b.html"), "b.html: exists already")
    assert_one_line(run("report", fit_file, scan_file, "-o", tmp_path / "c"), "report of one fit, not of 2")
    html = ("--html", tmp_path / "c.html")
    assert_one_line(run("view", fit_file, *html, "--overlay"), "--overlay belongs to pictures")
    assert_one_line(
        run("view", fit_file, *html, "--theta-i", "30,45"), "starts at one value and has a slider"
    )
    assert_one_line(run("view", fit_file, *html, "--floor", "1"), "--colour and --floor belong to pictures")
    assert not (tmp_path / "c.html").exists()
    result = run("report", fit_file, "-o", tmp_path / "report")
    assert result[0] == 0
    assert "report.html" in result[2]
    assert_one_line(
        run("report", fit_file, "-o", tmp_path / "report"), "report.html: exists already", "--overwrite"
    )


def test_mistakes(run, fit_file, scan_file, small_scan, tmp_path, monkeypatch):
    png = ("--png", tmp_path / "a.png")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    from clbrdf.viz import graphics

    graphics._screen_answers.cache_clear()
    assert_one_line(run("view", fit_file), "no display for a window here", "--png", "--html", "--serve")
    graphics._screen_answers.cache_clear()
    assert_one_line(run("view", tmp_path / "no.h5", *png), "no.h5: no such file")
    (tmp_path / "there.png").write_bytes(b"")
    assert_one_line(run("view", fit_file, "--png", tmp_path / "there.png"), "there.png: exists already")
    assert_one_line(run("view", fit_file, "--png", tmp_path / "n.jpg"), "--png writes .png files")
    assert_one_line(run("view", fit_file, *png, "--size", "big"), "--size 'big': write width x height")
    assert_one_line(run("view", fit_file, *png, "--size", "10x10"), "size 10x10: sides lie between")
    assert_one_line(run("view", fit_file, *png, "--wavelength", "2000"), "no wavelength near 2000 nm")
    assert_one_line(run("view", fit_file, *png, "--theta-i", "95"), "--theta-i 95")
    assert_one_line(
        run("view", scan_file, *png, "--theta-i", "10"), "was not measured at θi = 10°", "30, 45, 60"
    )
    assert_one_line(run("view", scan_file, *png, "--difference"), "--difference needs two files")
    assert_one_line(run("view", fit_file, *png, "--colour", "spectrum"), "colour by value instead")
    assert_one_line(
        run("view", fit_file, *png, "--radius", "log", "--floor", "-1"), "floor of the logarithmic"
    )
    assert_one_line(
        run("view", fit_file, "--html", tmp_path / "a.html", "--transparent"), "--transparent belongs"
    )
    assert_one_line(run("view", fit_file, *png, "--theta-i", "0:45:5"), "10 lobes in one picture; at most 9")
    assert_one_line(run("view", fit_file, "--gif", tmp_path / "a.gif", "--frames", "1"), "--frames 1")
    assert_one_line(
        run("view", fit_file, "--png", tmp_path / "no" / "a.png"), "does not exist; create it first"
    )
    assert_one_line(
        run("report", scan_file, "-o", tmp_path / "r"), "scan.h5: holds a scan, and a fit is needed"
    )
    assert not (tmp_path / "r").exists()
    assert_one_line(run("view", fit_file, "--serve", "--port", "99999"), "--port 99999: ports lie between 0")
    masked = tmp_path / "masked.h5"
    all_masked(small_scan).save(masked)
    assert_one_line(
        run("view", masked, *png), "nothing to show: all 144 values are masked (not_measured 144)"
    )
    apart = tmp_path / "apart.h5"
    Scan([45.0], 0.0, [77.7], 180.0, [550.0], [[1.0]], sample="apart").save(apart)
    assert_one_line(run("view", scan_file, apart, *png, "--difference"), "no direction in common")
    text = tmp_path / "text.h5"
    text.write_text("BRDF")
    assert_one_line(run("view", text, *png), "not an HDF5 file")
    assert not (tmp_path / "a.png").exists()


def test_one_direction_and_masked_wavelengths_are_pictures(run, small_scan, tmp_path):
    Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]], sample="one").save(tmp_path / "one.h5")
    all_masked(small_scan, 1).save(tmp_path / "part.h5")
    for name, words in (("one", ()), ("part", ("--wavelength", "550"))):
        out = tmp_path / f"{name}.png"
        assert run("view", tmp_path / f"{name}.h5", "--png", out, "--size", "400x300", *words)[0] == 0
        with Image.open(out) as picture:
            assert np.asarray(picture).std() > 5

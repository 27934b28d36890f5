"""The report: complete in itself, honest about warnings, and whole where something is missing."""

from __future__ import annotations

import csv
import re
from dataclasses import replace

import numpy as np
import pytest

from clbrdf import InputError, Scan
from clbrdf.fit.carried import Part
from clbrdf.viz import demo_pictures, graphics, report, write_report
from clbrdf.viz.curves import measured_and_model, spectral_map
from clbrdf.viz.report_parts import figure as drawn_figure
from clbrdf.viz.report_words import fit_table, warning_lines
from clbrdf.viz.spectra import parameter_spectra, quality_spectra, spectra_words
from tests.planted import with_parameters, with_part
from tests.viz.conftest import FOIL, all_masked, fit_of


def without_graphics(monkeypatch):
    monkeypatch.setattr(graphics, "_trial", lambda kind, off_screen: "")
    graphics.off_screen_kind.cache_clear()
    graphics._screen_answers.cache_clear()


@pytest.fixture
def no_gl(monkeypatch):
    without_graphics(monkeypatch)
    yield
    graphics.off_screen_kind.cache_clear()
    graphics._screen_answers.cache_clear()


@pytest.fixture(scope="session")
def pictures(gl, tmp_path_factory):
    """The demo's pictures of the tin foil of Table 1: the report among them."""
    theta_r = np.tile(np.linspace(0.0, 75.0, 16), 3)
    scan = Scan(
        np.repeat([30.0, 45.0, 60.0], 16), 0.0, theta_r, 180.0, [450.0, 550.0, 650.0], np.ones((48, 3))
    )
    folder = tmp_path_factory.mktemp("demo") / "pictures"
    fit, told = fit_of(scan, FOIL), []
    files, missing = demo_pictures(fit, folder, report=lambda k, n: told.append((k, n)))
    assert told[-1][0] == told[-1][1]
    return fit, folder, files, missing


def test_everything_is_on_one_page(pictures):
    fit, folder, files, _ = pictures
    assert [f.name for f in files[:4]] == ["report.html", "parameters.csv", "lobes.png", "lobes_log.png"]
    text = (folder / "report.html").read_text(encoding="utf-8")
    for words in (
        "Measured and model",
        "Parameters over wavelength",
        "Quality of the fit",
        "Lobes",
        "Provenance",
    ):
        assert f"<h2>{words}</h2>" in text
    assert text.count("<img ") == 6
    sources = re.findall(r"src=\"([^\"]{12})", text)
    assert all(source.startswith("data:image/") for source in sources)
    assert "http" not in re.sub(r"base64,[^\"]*", "", text)
    with pytest.raises(InputError, match=r"report\.html: exists already"):
        write_report(fit, folder)


def test_the_table_holds_the_parameters(pictures):
    fit, folder, _, _ = pictures
    with open(folder / "parameters.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["wavelength_nm"]) for row in rows] == [450.0, 550.0, 650.0]
    np.testing.assert_allclose([float(r["ks"]) for r in rows], fit.parameters["ks"])
    assert rows[0]["status"] == "converged"
    assert float(rows[0]["sigma_r_45deg_percent"]) == pytest.approx(6.0)


def test_the_demo_leaves_a_page_that_computes(pictures):
    _, _, files, missing = pictures
    assert missing == []
    assert files[-1].name == "brdf.html"
    assert files[-1].is_file()


def test_figures_show_the_fit(foil):
    figure = parameter_spectra(foil.fit)
    lines = {axes.get_ylabel(): axes.get_lines()[0].get_ydata() for axes in figure.axes}
    assert set(lines) == set(FOIL)
    np.testing.assert_array_equal(lines["ks"], foil.fit.parameters["ks"])
    figure = quality_spectra(foil.fit)
    left, right = figure.axes
    np.testing.assert_array_equal(left.get_lines()[0].get_ydata(), foil.fit.objective)
    assert len(right.get_lines()) == 3
    np.testing.assert_allclose(right.get_lines()[0].get_ydata(), 6.0)


def test_intervals_and_both_parts_of_1_sigma(foil):
    sigma, vector = foil.fit.estimate.sigma, foil.fit.vector
    halves = [
        Part(name, "", (share * sigma)[:, :, None] ** 2 * np.eye(6), np.zeros((0, *sigma.shape)), common)
        for name, share, common in (("noise", 0.6, False), ("panel", 0.8, True))
    ]
    fit = with_part(foil.fit, "estimate", parts=tuple(halves), lower=vector - sigma, upper=vector + 2 * sigma)
    names, rows = fit_table(fit)
    place = names.index("ks")
    assert names[place : place + 6] == ["ks", *(f"ks_{e}" for e in PARTS)]
    j = fit.model.names.index("ks")
    expected = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 1.0])[:, None] * vector[:, j]
    expected += np.array([0.0, 1.0, 0.6, 0.8, -1.0, 2.0])[:, None] * sigma[:, j]
    np.testing.assert_allclose([row[place : place + 6] for row in rows], expected.T, rtol=1e-12)
    assert fit_table(foil.fit)[0][1:3] == ["a", "a_sigma"]
    axes = next(a for a in parameter_spectra(fit).axes if a.get_ylabel() == "ks")
    ends = [segment[:, 1] for segment in axes.collections[-1].get_segments()]
    np.testing.assert_allclose(ends, np.array([vector - sigma, vector + 2 * sigma])[:, :, j].T)
    assert "its random part" in spectra_words(fit)
    assert "68.3 % intervals" in spectra_words(fit)
    assert spectra_words(foil.fit) == "Bands: 1σ."


PARTS = ("sigma", "sigma_random", "sigma_common", "lower", "upper")


def test_unknown_uncertainties_are_marked(foil):
    sigma = {n: np.array(v) for n, v in foil.fit.sigma.items()}
    sigma["kd"][1] = np.inf
    figure = parameter_spectra(with_parameters(foil.fit, foil.fit.parameters, sigma))
    axes = next(a for a in figure.axes if a.get_ylabel() == "kd")
    assert any(len(line.get_xdata()) == 1 and line.get_xdata()[0] == 550.0 for line in axes.get_lines())


def test_warnings(foil, small_scan):
    plane = "measured in the plane of incidence only: beside it the model is not held by any point"
    assert warning_lines(foil.fit) == [plane]
    poor = with_part(foil.fit, "goodness", relative_rms=np.full(3, 0.26))
    assert "the model misses the data by 26 %" in warning_lines(poor)[0]
    fit = fit_of(all_masked(small_scan, 1), FOIL)
    status = np.array(["ambiguous", "no data", "converged"])
    fit = with_part(fit, "search", not_finite=np.array([3, 0, 4]), evaluations=np.array([50, 0, 50]))
    undetermined = np.zeros((3, 6), dtype=bool)
    undetermined[0, :2] = True
    fit = with_part(replace(fit, status=status), "estimate", undetermined=undetermined)
    often = with_part(fit, "search", evaluations=np.array([9000, 0, 9000]))
    assert "not finite" not in "\n".join(warning_lines(often))
    lines = "\n".join(warning_lines(fit))
    for words in (
        "no data at 550 nm",
        "ambiguous at 450 nm",
        "a and b cannot be determined: other values fit as well, at 450 nm",
        "48 values (33.3 %) are masked as not measured",
        "7 of 100 evaluations of the search were not finite",
    ):
        assert words in lines


@pytest.mark.parametrize("case", ["one direction", "unfitted"])
def test_poor_fits_still_give_a_report(gl, small_scan, case, tmp_path):
    if case == "one direction":
        fit = fit_of(Scan([45.0], 0.0, [45.0], 180.0, [450.0, 550.0], [[0.5, 0.6]]), FOIL)
    else:
        fit = fit_of(all_masked(small_scan, 0), {n: [np.nan, v, v] for n, v in FOIL.items()})
        fit = with_part(fit, "goodness", objective=np.array([np.nan, 0.1, 0.1]))
    files, missing = write_report(fit, tmp_path)
    assert missing == ""
    assert files[2].stat().st_size > 10_000


def test_a_figure_that_cannot_be_drawn_says_why(small_scan):
    turned = replace(small_scan, phi_r=np.full(48, 90.0), theta_r=small_scan.theta_r + 5.0)
    for draw in (measured_and_model, spectral_map):
        text = drawn_figure(lambda draw=draw: draw(fit_of(turned, FOIL)), "svg", "")
        assert text.startswith("<p>Not drawn: ")
        assert "plane of incidence" in text


def test_without_graphics_the_report_says_so_and_goes_on(no_gl, foil, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "_figures", lambda fit: [])  # they need no OpenGL, and time
    files, lines = demo_pictures(foil.fit, tmp_path)
    assert len(lines) == 1
    assert lines[0].startswith("no lobes: no OpenGL library works here")
    assert [f.name for f in files] == ["report.html", "parameters.csv", "brdf.html"]
    assert "Not drawn: no OpenGL" in files[0].read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_made(foil, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        write_report(foil.fit, tmp_path / "file" / "r")

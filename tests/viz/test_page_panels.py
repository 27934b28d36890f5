"""What panels show, of what they have nothing for, and what can be saved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions, Scan
from clbrdf.colour import colour_weights
from clbrdf.models import get_model
from clbrdf.viz.page import PageSubject, save_page
from tests.planted import with_parameters, with_part
from tests.viz.browsing import comes_true, readout, settled
from tests.viz.conftest import FOIL, all_masked, fit_by_hand, fit_of


def test_csv_and_pictures(show, foil_page):
    browser = show(foil_page)
    settled(browser)
    text = browser.execute_script(
        """const kept = [];
        const make = URL.createObjectURL;
        URL.createObjectURL = (blob) => { kept.push(blob); return make.call(URL, blob); };
        const click = HTMLAnchorElement.prototype.click;
        HTMLAnchorElement.prototype.click = () => {};
        const buttons = [...document.querySelectorAll('.save [data-kind]')].filter((b) => b.offsetParent);
        buttons.forEach((b) => b.click());
        return new Promise((done) => {
          const look = async (patience) => {
            if (kept.length < buttons.length && patience) return setTimeout(look, 200, patience - 1);
            HTMLAnchorElement.prototype.click = click;
            URL.createObjectURL = make;
            const text = async (b) => (b.type === 'image/png' ? '' : await b.text());
            done(await Promise.all(kept.map(async (b) => [b.type, b.size, await text(b)])));
          };
          look(100);
        });"""
    )
    kinds = [kind for kind, _, _ in text]
    # Maps, lobe, slice, sphere; cut, spectrum, parameters by hand and over wavelength, energy. There is no
    # colour of three wavelengths.
    assert kinds.count("image/png") == 4
    assert kinds.count("image/svg+xml") == 5
    assert kinds.count("text/csv") == 10
    for kind, size, content in text:
        assert size > 100
        if kind == "image/svg+xml":
            assert "var(--" not in content
        if kind == "text/csv":
            lines = [line for line in content.splitlines() if not line.startswith("#")]
            assert len({line.count(",") for line in lines}) == 1
    points = next(c for k, _, c in text if k == "text/csv" and "deviation_percent" in c)
    rows = [line.split(",") for line in points.splitlines() if line[0].isdigit()]
    there = foil_page.scan.rows(foil_page.scan.theta_i == 45.0)
    assert [float(row[4]) for row in rows] == there.brdf[:, 1].tolist()


def test_a_scan_alone_bands_holes_and_one_direction(show, hemisphere, small_scan):
    browser = show(PageSubject("plaster", hemisphere))
    assert "model_per_sr" not in readout(browser)
    hidden = browser.execute_script("return [...document.querySelectorAll('section[hidden]')].map(s => s.id)")
    assert set(hidden) == {"slice", "sphere", "live", "strip", "energy", "colour"}
    one = Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]], sample="one")
    assert readout(show(PageSubject("one", one)))["measured_per_sr"] == 0.5
    bands = Scan([45.0], 0.0, [45.0], 180.0, [np.nan] * 3, [[0.5, 0.25, 0.125]], bands=("R", "G", "B"))
    browser = show(PageSubject("bands", bands), fragment="band=G")
    assert browser.execute_script("return clbrdf.state.column") == 1
    gone = all_masked(small_scan, 1)
    browser = show(PageSubject("holes", gone, fit_of(gone, FOIL)), fragment="nm=550")
    assert "masked: not measured" in browser.find_element("id", "readout").text
    whole = all_masked(small_scan)
    fit = fit_of(whole, {n: np.full(3, np.nan) for n in FOIL}, "no data")
    browser = show(PageSubject("nothing", whole, fit))
    assert "nothing is fitted" in browser.find_element("id", "readout").text


def test_an_incident_azimuth_for_surfaces_that_tell_it(show):
    model = get_model("ggx_anisotropic")
    theta_r, phi = (a.ravel() for a in np.meshgrid(np.arange(0.0, 80.0, 20.0), np.arange(0.0, 360.0, 45.0)))
    n = len(phi)
    phi_i = np.repeat([0.0, 60.0], n)
    scan = Scan(45.0, phi_i, np.tile(theta_r, 2), np.tile(phi, 2) + phi_i, [550.0], np.ones((2 * n, 1)))
    browser = show(
        PageSubject("brushed", scan, fit_by_hand(scan, model)), fragment="phi_i=60&theta_r=30&phi=135"
    )
    expected = model.brdf(model.defaults[None], model.features(Directions(45.0, 60.0, 30.0, 195.0)))[0]
    assert readout(browser)["model_per_sr"] == pytest.approx(expected, rel=1e-12)
    assert browser.execute_script("const s = clbrdf.subjects[0]; return s.rows(45, 60).length") == n
    assert browser.find_element("id", "phi-i").is_displayed()


def test_several_files_and_their_ratio(show, foil_page, hemisphere):
    other = fit_of(foil_page.scan, {**FOIL, "kd": 2.0})
    browser = show(foil_page, PageSubject("other", other.scan, other), PageSubject("plaster", hemisphere))
    options = browser.execute_script("return [...document.querySelectorAll('#file option')].map(o => o.text)")
    assert options == ["foil", "other", "plaster"]
    browser.execute_script("clbrdf.act.set({scale: 'ratio', ratio: 'file2', thetaR: 0})")
    expected = (
        clbrdf.evaluate(FOIL, 45.0, 20.0, 90.0)[0] / clbrdf.evaluate({**FOIL, "kd": 2.0}, 45.0, 20.0, 90.0)[0]
    )
    script = "const v = clbrdf.view(); return v.f(45, 0, 20, 90) / v.reference.of(45, 0, 20, 90)"
    assert browser.execute_script(script) == pytest.approx(expected, rel=1e-12)
    browser.execute_script("clbrdf.act.subject(1)")
    assert browser.execute_script("return clbrdf.state.ratio") == "mean"  # a file has no ratio to itself
    browser.execute_script("clbrdf.act.subject(2)")
    assert comes_true(lambda: browser.find_element("id", "name").text == "plaster")
    assert browser.execute_script("return clbrdf.state.scale") == "ratio"


def test_no_control_is_dead_and_all_have_names(show, foil_page):
    browser = show(foil_page)
    nameless = browser.execute_script(
        """return [...document.querySelectorAll('button, input, select, canvas, svg[role=img]')]
        .filter(e => e.offsetParent && !e.getAttribute('aria-label'))
        .filter(e => !(e.labels && e.labels.length) && !e.textContent.trim())
        .map(e => e.outerHTML.slice(0, 80))"""
    )
    assert nameless == []


@pytest.mark.parametrize("width", [400, 1280, 3840])
def test_nothing_sticks_out(show, foil_page, width):
    browser = show(foil_page)
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        assert comes_true(
            lambda: browser.execute_script("return document.documentElement.scrollWidth <= innerWidth")
        )
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_uncertainty_of_a_colour_difference(show):
    """Against differences of ΔE itself, parameter by parameter and wavelength by wavelength."""
    wavelength = np.arange(400.0, 701.0, 20.0)
    theta_r = np.arange(0.0, 61.0, 20.0)
    scan = Scan(45.0, 0.0, theta_r, 180.0, wavelength, np.full((4, len(wavelength)), 0.2), sample="paint")
    model = get_model("ggx+lambert")
    fit = fit_by_hand(scan, model)
    values = {n: np.array(v) for n, v in fit.parameters.items()}
    values["lambert.rho"] = np.linspace(0.1, 0.7, len(wavelength))
    correlation = np.full((len(wavelength), len(values), len(values)), 0.4)
    correlation[:, range(len(values)), range(len(values))] = 1.0
    fit = with_part(with_parameters(fit, values), "estimate", correlation=correlation)
    browser = show(PageSubject("paint", scan, fit), fragment="theta_i=45&theta_r=40&phi=180")
    script = """const button = document.querySelector('#colour .save [data-kind=csv]');
        const make = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
        let kept; URL.createObjectURL = (b) => { kept = b; return make.call(URL, b); };
        HTMLAnchorElement.prototype.click = () => {}; button.click();
        URL.createObjectURL = make; HTMLAnchorElement.prototype.click = click; return kept.text();"""
    lines = [line for line in browser.execute_script(script).splitlines() if not line.startswith("#")]
    rows = [dict(zip(lines[0].split(","), line.split(","), strict=True)) for line in lines[1:]]
    row = next(r for r in rows if float(r["theta_r_deg"]) == 50.0 and float(r["phi_deg"]) == 180.0)
    for light in ("D65", "A"):
        weights = np.pi * colour_weights(wavelength, light)
        white = weights.sum(axis=1) / np.pi

        def delta(vector, weights=weights, white=white):
            x = model.features(Directions.relative(45.0, [50.0, 0.0], 180.0))
            xyz = weights @ np.array([model.brdf(v[None], x) for v in vector])
            t = (xyz / white[:, None]).T
            f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
            lab = np.stack([116 * f[:, 1], 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])
            return float(np.linalg.norm(lab[:, 0] - lab[:, 1]))

        variance = 0.0
        for k in range(len(wavelength)):
            slope = np.zeros(len(values))
            for j, name in enumerate(model.names):
                step = 1e-5 * fit.vector[k, j]
                up, down = np.array(fit.vector), np.array(fit.vector)
                up[k, j] += step
                down[k, j] -= step
                slope[j] = (delta(up) - delta(down)) / (2.0 * step) * fit.sigma[name][k]
            variance += slope @ correlation[k] @ slope
        assert float(row[f"dE_{light}"]) == pytest.approx(delta(fit.vector), rel=1e-9)
        # Correlations are kept in single precision, and the reference is a difference quotient.
        assert float(row[f"dE_sigma_{light}"]) == pytest.approx(np.sqrt(variance), rel=1e-4)


def test_the_sphere_of_a_perfect_diffuser_darkens_with_the_cosine(show, small_scan):
    fit = fit_by_hand(small_scan, get_model("lambert"))
    browser = show(PageSubject("lambert", small_scan, fit), fragment="light=30,20")
    script = """const c = document.querySelector('canvas.sphere'), n = c.width;
        const data = c.getContext('2d').getImageData(0, 0, n, n).data;
        return [[0, 0], [0.3, 0], [-0.3, 0.2], [-0.9, 0]].map(([x, y]) => {
          const k = 4 * (n * Math.round(n * (0.5 - 0.48 * y)) + Math.round(n * (0.5 + 0.48 * x)));
          return [x, y, ...data.slice(k, k + 4)]; })"""
    az, el = np.deg2rad([30.0, 20.0])
    light = [np.sin(az) * np.cos(el), np.sin(el), np.cos(az) * np.cos(el)]
    shown, expected = [], []
    for x, y, red, green, blue, opaque in browser.execute_script(script):
        assert opaque == 255
        assert max(red, green, blue) - min(red, green, blue) <= 3
        shown.append(((green / 255.0 + 0.055) / 1.055) ** 2.4 if green > 10 else 0.0)
        expected.append(max(0.0, float(np.dot([x, y, np.sqrt(1.0 - x * x - y * y)], light))))
    assert expected[3] == shown[3] == 0.0  # beyond the terminator
    shown, expected = np.array(shown[:3]), np.array(expected[:3])
    np.testing.assert_allclose(shown / shown[0], expected / expected[0], rtol=0.03)  # 8 bits, whole pixels


def test_without_scripts_there_are_still_pictures(browser, foil_page, tmp_path):
    save_page([foil_page], tmp_path / "a.html")
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.get((tmp_path / "a.html").as_uri())
        picture = browser.find_element("css selector", ".stills img")
        assert picture.size["width"] > 600
        assert "θi = 45°, 550 nm" in picture.get_attribute("alt")
        assert not browser.find_element("id", "controls").is_displayed()
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def test_a_fit_that_the_page_cannot_compute_is_said_and_shown(show, foil_page, monkeypatch):
    def refuse(formula):
        raise KeyError("besselj")

    monkeypatch.setattr("clbrdf.viz.page.record.javascript_text", refuse)
    browser = show(foil_page)
    assert "model_per_sr" not in readout(browser)
    assert browser.find_element("css selector", ".stills img").is_displayed()
    warnings = browser.find_element("css selector", ".warnings").text
    assert "the fit of wang2013 is not computed here" in warnings
    assert "besselj" in warnings


def test_a_fit_without_uncertainties_shows_none(show, foil_page):
    fit = foil_page.fit
    none = with_part(fit, "estimate", sigma=np.full(fit.vector.shape, np.nan))
    bare = replace(fit.scan, sigma=None)
    browser = show(
        PageSubject("foil", bare, replace(none, scan=bare)), fragment="theta_i=45&theta_r=50&phi=180"
    )
    assert "model_per_sr" in readout(browser)
    assert "±" not in browser.find_element("id", "readout").text
    assert browser.find_elements("css selector", "#cut polygon") == []

"""The page that computes, in a real browser without a network: numbers, controls, what it says of itself."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions, InputError, Scan
from clbrdf.models import get_model
from clbrdf.objective import objective, weight_matrix
from clbrdf.viz.page import PageSubject, open_for_page, page_text, save_page
from clbrdf.viz.page.record import subject_record
from clbrdf.viz.page.thin import DIRECTION_BYTES, DOUBLE_BYTES, LARGEST, SINGLE_BYTES, thinning
from tests.planted import with_part
from tests.viz.browsing import comes_true
from tests.viz.conftest import FOIL, all_masked, fit_of

STILL = "return clbrdf.frames"


@pytest.fixture
def show(browser, tmp_path):
    """Write a page of subjects and open it, offline; whatever the browser complains of fails the test."""
    browser.get_log("browser")
    browser.set_network_conditions(offline=True, latency=0, throughput=0)

    def go(*subjects, fragment=""):
        path = tmp_path / "brdf.html"
        save_page(list(subjects), path, overwrite=True)
        browser.get("about:blank")
        browser.get(path.as_uri() + (f"#{fragment}" if fragment else ""))
        assert comes_true(lambda: browser.execute_script("return !!(window.clbrdf && clbrdf.frames)"))
        return browser

    yield go
    browser.delete_network_conditions()
    assert [line["message"] for line in browser.get_log("browser")] == []


@pytest.fixture
def foil_page(foil):
    return PageSubject(foil.name, foil.scan, foil.fit, "fit.h5")


def readout(browser):
    """Numbers that the readout shows, in full, by name."""
    script = """return [...document.querySelectorAll('#readout [data-value]')]
        .map(e => [e.dataset.name, e.dataset.value])"""
    return {name: float(value) for name, value in browser.execute_script(script)}


def shows(browser, name, value, tolerance=1e-9):
    """Whether a number of the readout comes to a value."""
    return comes_true(lambda: abs(readout(browser).get(name, np.inf) - value) <= tolerance)


def test_the_page_fetches_nothing_and_is_small(foil_page):
    text = page_text([foil_page])
    assert "<title>foil: BRDF</title>" in text
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    assert "default-src 'none'" in text
    assert len(text) < 400_000
    assert not re.search(r"\{\{[A-Z]+\}\}", text)


def test_numbers_at_the_cursor(show, foil_page):
    browser = show(foil_page, fragment="nm=550&theta_i=45&theta_r=50&phi=180")
    found = readout(browser)
    expected = clbrdf.evaluate(FOIL, 45.0, 50.0, 180.0)[0]
    row = np.flatnonzero((foil_page.scan.theta_i == 45.0) & (foil_page.scan.theta_r == 50.0))[0]
    assert found["model_per_sr"] == pytest.approx(expected, rel=1e-12, abs=0)
    assert found["measured_per_sr"] == foil_page.scan.brdf[row, 1]
    assert found["deviation_percent"] == pytest.approx(0.0, abs=1e-9)


def test_the_uncertainty_follows_from_the_parameters(show, foil_page):
    """By hand from the covariance, for a direction where lobe and base both count."""
    fit = foil_page.fit
    size = len(fit.model.names)
    correlation = np.full((3, size, size), 0.3)
    correlation[:, range(size), range(size)] = 1.0
    browser = show(PageSubject("foil", fit.scan, with_part(fit, "estimate", correlation=correlation)))
    d = fit.model.jacobian(fit.vector[1][None], fit.model.features(Directions.relative(45.0, 60.0, 170.0)))[0]
    spread = d * np.array([fit.sigma[n][1] for n in fit.model.names])
    expected = np.sqrt(spread @ correlation[1] @ spread)
    found = browser.execute_script("return clbrdf.view().uncertainty(45, 0, 60, 170)")
    assert found == pytest.approx(expected, rel=1e-6)  # correlations are kept in single precision


@pytest.mark.parametrize("weights", ["none", "relative", "sigma", "given"])
def test_the_objective_is_that_of_the_fit(show, foil_page, weights):
    rng = np.random.default_rng(1)
    scan = foil_page.fit.scan
    scan = replace(scan, brdf=scan.brdf * (1.0 + 0.05 * rng.standard_normal(scan.brdf.shape)))
    scan = all_masked_part(scan)
    fit = fit_of(scan, FOIL)
    g = weight_matrix(scan, rng.uniform(0.5, 2.0, len(scan)) if weights == "given" else weights)
    fit = with_part(fit, "setup", weights=g, weighting=weights)
    browser = show(PageSubject("foil", scan, fit))
    expected = objective(fit.evaluate(), scan, g)
    for column in range(3):
        script = f"const s = clbrdf.subjects[0]; return s.objective(s.parameters({column}), {column})"
        rel = 1e-6 if weights == "given" else 1e-12  # weights of one's own are kept in single precision
        assert browser.execute_script(script) == pytest.approx(expected[column], rel=rel)


def all_masked_part(scan):
    flags = np.array(scan.flags)
    flags[::5, 1] |= np.uint32(1)
    return replace(scan, flags=flags)


@pytest.mark.parametrize("name", ["wang2013", "ggx_anisotropic", "hapke", "eon+ggx"])
def test_maps_over_the_hemisphere(show, foil_page, name):
    """The numbers behind the pixels, which the colours follow; and the pixel in the mirror direction."""
    model = get_model(name)
    scan = foil_page.scan
    fit = fit_by_hand(scan, model)
    browser = show(PageSubject("map", scan, fit), fragment="theta_i=45&scale=linear")
    pixels = np.array(browser.execute_script("return clbrdf.maps.sample(clbrdf.view(), 7)"))
    assert len(pixels) > 2000
    assert pixels[:, 0].max() > 85.0
    directions = Directions(45.0, 0.0, pixels[:, 0], pixels[:, 1])
    expected = model.brdf(model.defaults[None], model.features(directions))
    assert np.abs(pixels[:, 2] - expected).max() <= 1e-12 * np.abs(expected).max()
    colours = browser.execute_script(
        """const c = document.querySelector('canvas[data-kind=model]'), [x, y] = [0.5, 0.5];
        return Array.from(c.getContext('2d').getImageData(c.width * x, c.height * y, 1, 1).data)"""
    )
    assert colours[3] == 255


def fit_by_hand(scan, model):
    """Return a fit of any model with its default parameters."""
    fit = fit_of(scan, FOIL)
    w = len(scan.labels)
    values = {p.name: np.full(w, p.default) for p in model.parameters}
    return replace(
        fit,
        model=model,
        parameters=values,
        sigma={n: 0.01 * np.abs(v) for n, v in values.items()},
        correlation=np.tile(np.eye(len(values)), (w, 1, 1)),
        bounds=model.bounds(),
    )


def test_every_control_by_mouse_and_keyboard(show, foil_page):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    browser = show(foil_page)

    def find(selector):
        return browser.find_element(By.CSS_SELECTOR, selector)

    wave = find("#wavelength")
    wave.send_keys(Keys.END)
    assert shows(browser, "wavelength_nm", 650.0)
    wave.send_keys(Keys.ARROW_LEFT)
    assert shows(browser, "wavelength_nm", 550.0)
    assert wave.get_attribute("aria-valuetext") == "550 nm"
    find("#less").click()
    assert shows(browser, "theta_i_deg", 30.0)
    find("#more").click()
    assert shows(browser, "theta_i_deg", 45.0)
    find("#theta-i").send_keys(Keys.ARROW_RIGHT * 2)
    assert shows(browser, "theta_i_deg", 46.0)
    assert "not measured" in find("#theta-i-now").text
    for scale in ("log", "ratio", "linear"):
        find(f"input[value={scale}]").click()
        assert comes_true(lambda s=scale: f"scale={s}" in browser.current_url)
    find("input[value=ratio]").click()
    assert [o.text for o in find("#ratio").find_elements(By.TAG_NAME, "option")] == [
        "the mean of the points",
        "1/cos θr, as BRDF × cosine",
        "kd/π",
    ]
    find("#ratio option[value=diffuse]").click()
    assert comes_true(lambda: "BRDF over kd/π" in find("#maps").get_attribute("innerHTML"))
    find("input[value=sigma]").click()
    assert comes_true(lambda: "residual=sigma" in browser.current_url)
    find("#hold").click()
    assert comes_true(lambda: "hold=" in browser.current_url)
    find("#hold").click()
    assert comes_true(lambda: "hold=" not in browser.current_url)
    # The cursor, with keys and with the mouse; a click next to a measured direction takes it.
    find("#less").click()
    map_of_model = find("canvas[data-kind=model]")
    map_of_model.send_keys(Keys.HOME)
    assert shows(browser, "theta_r_deg", 45.0)
    map_of_model.send_keys(Keys.ARROW_UP)
    assert shows(browser, "theta_r_deg", 46.0)
    map_of_model.send_keys(Keys.SHIFT + Keys.ARROW_DOWN)
    assert shows(browser, "theta_r_deg", 36.0)
    map_of_model.send_keys(Keys.ARROW_LEFT)
    assert shows(browser, "phi_deg", 181.0)
    half = map_of_model.size["width"] / 2
    share = browser.execute_script("return arguments[0].discShare", map_of_model)
    r = np.sin(np.deg2rad(15.0)) / np.sin(np.deg2rad(45.0)) * half * share
    ActionChains(browser, duration=20).move_to_element_with_offset(
        map_of_model, round(r) + 2, 2
    ).click().perform()
    assert shows(browser, "theta_r_deg", 30.0)
    assert shows(browser, "phi_deg", 180.0)
    # The lobe turns by dragging and by keys.
    lobe = find("canvas.lobe")
    before = browser.execute_script("return clbrdf.state.azimuth")
    ActionChains(browser, duration=20).move_to_element(lobe).click_and_hold().move_by_offset(
        40, 0
    ).release().perform()
    assert comes_true(lambda: browser.execute_script("return clbrdf.state.azimuth") != before)
    lobe.send_keys(Keys.ARROW_UP)
    # A parameter, and back.
    field = find("#live input[type=number]")
    field.send_keys(Keys.CONTROL + "a" + Keys.NULL + "4.5" + Keys.ENTER)
    assert comes_true(lambda: "parameters=4.5" in browser.current_url)
    expected = clbrdf.evaluate({**FOIL, "a": 4.5}, 45.0, 30.0, 180.0)[0]
    assert shows(browser, "model_per_sr", expected, 1e-12 * expected)
    assert "times less" in find("#live .verdict").text
    find("#live .reset").click()
    assert comes_true(lambda: "parameters=" not in browser.current_url)
    slider = find("#live input[type=range]")
    slider.send_keys(Keys.ARROW_RIGHT)
    assert comes_true(lambda: "parameters=" in browser.current_url)
    find("#points summary").click()
    assert len(browser.find_elements(By.CSS_SELECTOR, "#points tbody tr")) == 16
    find("#points tbody tr:last-child").click()
    assert shows(browser, "theta_r_deg", 75.0)
    # A click in a plot chooses an angle or a wavelength.
    svg = find("#spectrum svg")
    ActionChains(browser, duration=20).move_to_element_with_offset(
        svg, round(svg.size["width"] / 2) - 30, 0
    ).click().perform()
    assert shows(browser, "wavelength_nm", 650.0)


def test_touch(show, foil_page):
    browser = show(foil_page)
    box = browser.execute_script(
        """const c = document.querySelector('canvas[data-kind=measured]');
        c.scrollIntoView({block: 'center'});
        const b = c.getBoundingClientRect();
        return [b.left + b.width / 2, b.top + b.height / 2]"""
    )
    point = [{"x": box[0], "y": box[1]}]
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": point})
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert shows(browser, "theta_r_deg", 0.0)


def test_a_state_survives_reload(show, foil_page):
    browser = show(
        foil_page, fragment="nm=650&theta_i=60&theta_r=20&phi=0&scale=log&residual=sigma&turn=10,40"
    )
    browser.execute_script("clbrdf.act.parameter(0, 3.5)")
    assert comes_true(lambda: "parameters=3.5" in browser.current_url)
    before = readout(browser)
    browser.refresh()
    assert comes_true(lambda: browser.execute_script("return !!(window.clbrdf && clbrdf.frames)"))
    assert readout(browser) == before
    assert before["theta_i_deg"] == 60.0
    assert before["phi_deg"] == 0.0


@pytest.mark.parametrize(
    "fragment",
    ["nm=abc&theta_i=95&phi=-1", "file=7&parameters=1,2", "to=file9&scale=odd&hold=3,1", "%%%", "band=x"],
)
def test_an_address_that_makes_no_sense_is_passed_over(show, foil_page, fragment):
    browser = show(foil_page, fragment=fragment)
    assert readout(browser)["theta_i_deg"] == 45.0


def test_csv_and_pictures(show, foil_page):
    browser = show(foil_page)
    text = browser.execute_script(
        """const kept = [];
        const make = URL.createObjectURL;
        URL.createObjectURL = (blob) => { kept.push(blob); return make.call(URL, blob); };
        const click = HTMLAnchorElement.prototype.click;
        HTMLAnchorElement.prototype.click = () => {};
        for (const b of document.querySelectorAll('.save button')) if (b.offsetParent) b.click();
        return new Promise((done) => setTimeout(async () => {
          HTMLAnchorElement.prototype.click = click;
          URL.createObjectURL = make;
          const text = async (b) => (b.type === 'image/png' ? '' : await b.text());
          done(await Promise.all(kept.map(async (b) => [b.type, b.size, await text(b)])));
        }, 1500));"""
    )
    kinds = [kind for kind, _, _ in text]
    assert kinds.count("image/png") == 2
    assert kinds.count("text/csv") >= 6
    assert kinds.count("image/svg+xml") >= 4
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
    assert set(hidden) == {"live", "strip", "energy", "colour"}
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


@pytest.mark.parametrize(
    ("directions", "wavelengths"), [(100_000, 4), (100, 2048), (10, 10), (5000, 5000), (1, 10**6), (10**6, 1)]
)
def test_thinning_keeps_the_budget_and_counts(directions, wavelengths):
    thin = thinning(directions, wavelengths, LARGEST, 248)
    n, w = len(thin.rows), len(thin.columns)
    each = DOUBLE_BYTES if thin.kind == "f8" else SINGLE_BYTES
    assert n * DIRECTION_BYTES + w * 248 + n * w * each <= LARGEST
    assert (np.diff(thin.rows) > 0).all()
    assert (np.diff(thin.columns) > 0).all()
    words = " ".join(thin.words)
    assert (f"{n} of {directions} directions" in words) == (n < directions)
    assert (f"{w} of {wavelengths} wavelengths" in words) == (w < wavelengths)


def test_a_large_scan_stays_below_five_megabytes():
    rng = np.random.default_rng(0)
    n = 100_000
    theta_r, phi = rng.uniform(0.0, 85.0, n), rng.uniform(0.0, 360.0, n)
    scan = Scan(30.0, 0.0, theta_r, phi, np.arange(400.0, 800.0, 100.0), rng.uniform(0.1, 1.0, (n, 4)))
    text = page_text([PageSubject("large", scan)])
    assert len(text) < 5_000_000
    assert "of 100000 directions are in this page" in text


def test_warnings_that_the_numbers_call_for(foil_page):
    lines = " ".join(subject_record(foil_page)["warnings"])
    assert "reflects more than it receives" in lines
    assert "not reciprocal" in lines
    assert "plane of incidence only" in lines
    assert json.dumps(subject_record(foil_page)["promises"]["theta_i"]) == "[30.0, 45.0, 60.0]"


def test_files(foil_file, small_scan, tmp_path):
    assert open_for_page(foil_file).fit is not None
    both = Scan([30.0, 30.0], 0.0, [30.0, 150.0], 180.0, [550.0], [[0.3], [0.2]], sample="film")
    both.save(tmp_path / "both.h5")
    assert "1 of 2 directions are of transmission" in open_for_page(tmp_path / "both.h5").said[0]
    with pytest.raises(InputError, match="holds 1 to 8 files"):
        page_text([])
    save_page([open_for_page(foil_file)], tmp_path / "a.html")
    with pytest.raises(InputError, match="exists already"):
        save_page([open_for_page(foil_file)], tmp_path / "a.html")

"""What a reader can do on the page: by mouse, keys and touch, and by its address."""

from __future__ import annotations

import numpy as np
import pytest

import clbrdf
from tests.viz.browsing import comes_true, readout, settled, shows
from tests.viz.conftest import FOIL

HALF = "const s = clbrdf.state; return clbrdf.half(s.thetaI, s.thetaR, s.phi)"


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
    settled(browser)
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
    # Lobe and cut are enlarged by buttons, the lobe by keys too; the link keeps it.
    find("#lobe [data-step=larger]").click()
    assert comes_true(lambda: browser.execute_script("return clbrdf.state.zoom") == 1.5)
    lobe.send_keys("+")
    assert comes_true(lambda: "zoom=1.875" in browser.current_url)
    find("#cut [data-step=larger]").click()
    assert comes_true(lambda: "span=45" in browser.current_url)
    browser.execute_script("clbrdf.act.set({zoom: 1, span: 90})")
    # The light of the sphere, and the slice, in which a click moves the incident angle too.
    find("canvas.sphere").send_keys(Keys.ARROW_RIGHT)
    assert comes_true(lambda: browser.execute_script("return clbrdf.state.light[0]") == -35)
    sphere = find("canvas.sphere")
    ActionChains(browser, duration=20).move_to_element(sphere).click_and_hold().move_by_offset(
        20, 0
    ).release().perform()
    assert comes_true(lambda: browser.execute_script("return clbrdf.state.light[0]") == -25)
    find("#slice input").send_keys(Keys.ARROW_RIGHT)
    assert comes_true(lambda: "phi_d=95" in browser.current_url)
    find("#slice canvas").send_keys(Keys.ARROW_UP)
    half = browser.execute_script(HALF)
    assert half["thetaD"] == pytest.approx(readout(browser)["theta_i_deg"], abs=40.0)
    ActionChains(browser, duration=20).move_to_element(find("#slice canvas")).click().perform()
    assert comes_true(lambda: abs(browser.execute_script(HALF)["thetaH"] - 44.0) < 6.0)
    browser.execute_script("clbrdf.act.set({thetaI: 45, thetaR: 30, phi: 180})")
    assert shows(browser, "theta_i_deg", 45.0)
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


def test_every_control_by_touch(show, foil_page):
    browser = show(foil_page)

    def send(kind, *points):
        words = {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]}
        browser.execute_cdp_cmd("Input.dispatchTouchEvent", words)

    def place(selector, x=0.5, y=0.5):
        settled(browser)  # controls move when others appear beside them
        return browser.execute_script(
            """const e = document.querySelector(arguments[0]);
            e.scrollIntoView({block: 'center'});
            const b = e.getBoundingClientRect();
            return [b.left + b.width * arguments[1], b.top + b.height * arguments[2]]""",
            selector,
            x,
            y,
        )

    def tap(selector, x=0.5, y=0.5):
        send("touchStart", place(selector, x, y))
        send("touchEnd")

    def drag(selector, right):
        x, y = place(selector)
        send("touchStart", (x, y))
        for step in (0.3, 0.6, 1.0):
            send("touchMove", (x + step * right, y))
        send("touchEnd")

    def state(name):
        return browser.execute_script(f"return clbrdf.state.{name}")

    tap("canvas[data-kind=measured]")
    assert shows(browser, "theta_r_deg", 0.0)
    tap("#wavelength", x=0.99)
    assert shows(browser, "wavelength_nm", 650.0)
    tap("#less")
    assert shows(browser, "theta_i_deg", 30.0)
    tap("#theta-i", x=0.7)
    assert comes_true(lambda: readout(browser)["theta_i_deg"] > 55.0)
    for scale in ("ratio", "linear", "log"):
        tap(f"input[value={scale}]")
        assert comes_true(lambda s=scale: state("scale") == s)
    tap("input[value=sigma]")
    assert comes_true(lambda: state("residual") == "sigma")
    tap("#hold")
    assert comes_true(lambda: state("hold") is not None)
    tap("#hold")
    for canvas, name in (("canvas.lobe", "azimuth"), ("canvas.sphere", "light[0]")):
        before = state(name)
        drag(canvas, 60)
        assert comes_true(lambda n=name, b=before: state(n) != b)
    tap("#slice canvas", x=0.3, y=0.6)
    assert comes_true(lambda: 15.0 < browser.execute_script(HALF)["thetaH"] < 25.0)
    tap("#slice input", x=0.02)
    assert comes_true(lambda: state("phiD") == 0)
    tap("#live input[type=range]", x=0.8)
    assert comes_true(lambda: state("live") is not None)
    tap("#live .reset")
    assert comes_true(lambda: state("live") is None)
    tap("#less")
    tap("#points summary")
    assert comes_true(lambda: browser.find_element("css selector", "#points tbody tr").is_displayed())
    tap("#points tbody tr:nth-child(3)")
    assert comes_true(lambda: readout(browser)["theta_r_deg"] == 10.0)


def test_a_state_survives_reload(show, foil_page):
    browser = show(
        foil_page,
        fragment="nm=650&theta_i=60&theta_r=20&phi=0&scale=log&residual=sigma&turn=10,40&phi_d=40&light=12,-7",
    )
    browser.execute_script("clbrdf.act.parameter(0, 3.5)")
    assert comes_true(lambda: "parameters=3.5" in browser.current_url)
    before = readout(browser)
    browser.refresh()
    assert comes_true(lambda: browser.execute_script("return !!(window.clbrdf && clbrdf.frames)"))
    assert readout(browser) == before
    assert before["theta_i_deg"] == 60.0
    assert before["phi_deg"] == 0.0
    assert browser.execute_script("return [clbrdf.state.phiD, clbrdf.state.light]") == [40, [12, -7]]


@pytest.mark.parametrize(
    "fragment",
    ["nm=abc&theta_i=95&phi=-1", "file=7&parameters=1,2", "to=file9&scale=odd&hold=3,1", "%%%", "band=x"],
)
def test_an_address_that_makes_no_sense_is_passed_over(show, foil_page, fragment):
    browser = show(foil_page, fragment=fragment)
    assert readout(browser)["theta_i_deg"] == 45.0

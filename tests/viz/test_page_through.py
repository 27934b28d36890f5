"""A page of a fit through an instrument: what it compares with measured values, and what it says of that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.fit.through import Through
from clbrdf.instrument.settings import Instrument
from clbrdf.models import get_model
from clbrdf.objective import objective
from clbrdf.viz.page import PageSubject, page_text
from clbrdf.viz.page import seen as seen_module
from clbrdf.viz.page.record import subject_record
from tests.planted import with_part
from tests.viz.browsing import readout, settled
from tests.viz.conftest import fit_by_hand

WAVELENGTH = np.array([450.0, 500.0, 550.0])


def fit_through(effects, model="ggx+lambert"):
    """A fit with default parameters, of values that are its own as seen, with noise."""
    theta_i, theta_r, phi = (
        a.ravel()
        for a in np.meshgrid([20.0, 50.0], np.arange(0.0, 71.0, 10.0), [0.0, 150.0, 180.0], indexing="ij")
    )
    scan = Scan(theta_i, 0.0, theta_r, phi, WAVELENGTH, np.ones((len(phi), 3)), sample="gloss")
    instrument = Instrument.model_validate(effects)
    # The point, three rings, and circles about the peak.
    levels = np.stack([np.arange(len(scan)) % 3, 2 * (np.arange(len(scan)) % 4)], axis=1).astype(np.uint8)
    levels *= np.array([instrument.beam is not None, instrument.aperture is not None], dtype=np.uint8)
    angle = None if instrument.aperture is None else np.full(len(scan), instrument.aperture.angle)
    fit = replace(fit_by_hand(scan, get_model(model)), through=Through(instrument, "rig.toml", angle, levels))
    noise = np.random.default_rng(3).normal(1.0, 0.02, scan.brdf.shape)
    scan = replace(scan, brdf=fit.observed() * noise, sigma=0.02 * np.abs(fit.observed()))
    return replace(fit, scan=scan)


APERTURE = {"aperture": {"angle": 8.0}}
BOTH = {"aperture": {"angle": 6.0}, "beam": {"angle": 2.0}, "footprint": {"beam": 5.0, "field": 6.0}}


@pytest.mark.parametrize(("effects", "model"), [(APERTURE, "ggx+lambert"), (BOTH, "ggx_anisotropic")])
def test_what_is_compared_is_what_the_detector_sees(show, effects, model):
    fit = fit_through(effects, model)
    scan, seen = fit.scan, fit.observed()
    assert np.abs(seen / fit.evaluate() - 1.0).max() > 0.05
    browser = show(PageSubject("gloss", scan, fit), fragment="nm=500&theta_i=50&theta_r=50&phi=180")
    told = browser.find_element("id", "seen").text
    assert "what the detector sees through: " in told
    assert "as rig.toml says" in told
    row = np.flatnonzero((scan.theta_i == 50.0) & (scan.theta_r == 50.0) & (scan.phi == 180.0))[0]
    found = readout(browser)
    assert found["seen_per_sr"] == pytest.approx(seen[row, 1], rel=1e-9)
    assert found["model_per_sr"] == pytest.approx(fit.evaluate()[row, 1], rel=1e-12)
    percent = 100.0 * (1.0 - seen[row, 1] / scan.brdf[row, 1])
    assert found["deviation_percent"] == pytest.approx(percent, abs=1e-6)
    points = browser.execute_script("return clbrdf.view().deviations.points.map(p => [p.row, p.value])")
    assert len(points) == 24
    for place, value in points:
        assert value == pytest.approx(100.0 * (1.0 - seen[place, 1] / scan.brdf[place, 1]), abs=1e-6)
    script = "const s = clbrdf.subjects[0]; return s.objective(s.parameters(1), 1)"
    assert browser.execute_script(script) == pytest.approx(
        objective(seen, scan, np.ones(seen.shape))[1], rel=1e-9
    )
    spectrum = browser.execute_script(
        f"""const s = clbrdf.subjects[0];
        return [0, 1, 2].map((k) => s.detector.values(s.parameters(k), k)({row}))"""
    )
    np.testing.assert_allclose(spectrum, seen[row], rtol=1e-9)
    words = browser.find_element("css selector", "#spectrum .help").text
    assert "the model as the detector sees it there" in words
    # Parameters by hand: every comparison follows, E too.
    moved = np.array(fit.vector)
    moved[1] = fit.vector[1] * 1.3
    by_hand = with_part(fit, "estimate", vector=moved).observed()
    browser.execute_script(f"clbrdf.act.live(Float64Array.from({moved[1].tolist()}))")
    settled(browser)
    assert readout(browser)["seen_per_sr"] == pytest.approx(by_hand[row, 1], rel=1e-9)
    value = float(browser.find_element("css selector", "#live .verdict b").get_attribute("data-value"))
    assert value == pytest.approx(objective(by_hand, scan, np.ones(seen.shape))[1], rel=1e-9)


def test_the_band_of_a_spectrum_is_that_of_what_is_seen(show):
    fit = fit_through(APERTURE)
    row = 16
    scan = fit.scan
    browser = show(
        PageSubject("gloss", scan, fit),
        fragment=f"theta_i={scan.theta_i[row]}&theta_r={scan.theta_r[row]}&phi={scan.phi[row]}",
    )
    found = browser.execute_script(f"return clbrdf.subjects[0].detector.spread(1)({row})")
    # By differences of what is seen.
    total = 0.0
    for j, name in enumerate(fit.model.names):
        step = 1e-5 * abs(fit.vector[1, j]) or 1e-6
        ends = []
        for sign in (-1.0, 1.0):
            moved = np.array(fit.vector)
            moved[1, j] += sign * step
            ends.append(with_part(fit, "estimate", vector=moved).observed()[row, 1])
        total += ((ends[1] - ends[0]) / (2.0 * step) * fit.sigma[name][1]) ** 2
    assert found == pytest.approx(np.sqrt(total), rel=1e-5)


def test_where_only_the_optimum_is_known_the_page_says_so(show, monkeypatch):
    monkeypatch.setattr(seen_module, "NODE_SHARE", 0.0)
    fit = fit_through(APERTURE)
    scan, seen = fit.scan, fit.observed()
    browser = show(PageSubject("gloss", scan, fit), fragment="nm=500&theta_i=50&theta_r=50&phi=180")
    row = np.flatnonzero((scan.theta_i == 50.0) & (scan.theta_r == 50.0) & (scan.phi == 180.0))[0]
    assert readout(browser)["seen_per_sr"] == seen[row, 1]
    assert "nodes of the instrument are too many for a page" in browser.find_element("id", "seen").text
    browser.execute_script("clbrdf.act.parameter(0, 0.2)")
    settled(browser)
    assert "seen_per_sr" not in readout(browser)
    assert "deviation_percent" not in readout(browser)
    assert browser.execute_script("return clbrdf.view().deviations.points.length") == 0
    text = browser.find_element("css selector", "#live .verdict").text
    assert "For parameters set by hand it is not computed here" in text
    assert "not known for parameters set by hand" in browser.find_element("id", "cut").text


def test_a_slit_leaves_the_optimum_only():
    fit = fit_through({**APERTURE, "bandwidth": {"width": 100.0}})
    record = subject_record(PageSubject("gloss", fit.scan, fit))["seen"]
    assert record["nodes"] is None
    assert "the slit ties neighbouring wavelengths" in record["words"]


def test_still_pictures_say_what_they_compare_with():
    fit = fit_through(APERTURE)
    text = page_text([PageSubject("gloss", fit.scan, fit)])
    assert "Residuals, cut and spectrum are of what the detector sees through: aperture 8°" in text

"""Numbers of the page, in a real browser without a network, against NumPy and the commands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions
from clbrdf.models import get_model
from clbrdf.objective import objective, weight_matrix
from clbrdf.viz.page import PageSubject
from tests.planted import with_part
from tests.viz.browsing import readout
from tests.viz.conftest import FOIL, fit_by_hand, fit_of


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

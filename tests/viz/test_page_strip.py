"""Parameters on a page: their intervals, and both parts of their uncertainties."""

from __future__ import annotations

import numpy as np

from clbrdf.fit.carried import Part
from clbrdf.viz.page import PageSubject
from tests.planted import with_part
from tests.viz.browsing import settled
from tests.viz.test_page_through import APERTURE, fit_through


def test_intervals_and_both_parts_of_an_uncertainty(show):
    fit = fit_through(APERTURE)
    sigma = fit.estimate.sigma
    halves = [_part("noise", 0.6 * sigma, False), _part("panel", 0.8 * sigma, True)]
    lower, upper = fit.vector - 1.1 * sigma, fit.vector + 1.3 * sigma
    fit = with_part(fit, "estimate", parts=tuple(halves), lower=lower, upper=upper)
    browser = show(PageSubject("gloss", fit.scan, fit), fragment="nm=500")
    settled(browser)
    cells = browser.execute_script(
        """return [...document.querySelectorAll('#strip .parameters tr')].map(
             (r) => [...r.querySelectorAll('th, td')].map((c) => c.textContent))"""
    )
    assert cells[0] == [
        "parameter",
        "value",
        "1σ",
        "random part",
        "common part",
        "68.3 % interval, by profile likelihood",
    ]
    for j, name in enumerate(fit.model.names):
        row = cells[1 + j]
        assert row[0] == name
        numbers = [float(text.replace("−", "-")) for text in (*row[1:5], *row[5].split(" to "))]
        expected = [fit.vector[1, j], *(np.array([1.0, 0.6, 0.8]) * sigma[1, j]), lower[1, j], upper[1, j]]
        np.testing.assert_allclose(numbers, expected, rtol=6e-3)
    help_text = browser.find_element("css selector", "#strip .help").text
    assert "its random part" in help_text
    assert "68.3 % interval" in help_text
    bars = browser.execute_script("return document.querySelectorAll('#strip svg path').length")
    assert bars == 3 * len(fit.model.names)


def _part(name, sigma, is_common):
    own = sigma[:, :, None] ** 2 * np.eye(sigma.shape[1])
    return Part(name, "", own, np.zeros((0, *sigma.shape)), is_common)

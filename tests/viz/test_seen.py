"""Figures and windows that compare with measured values show what the detector sees."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.viz.curves import measured_and_model, model_word, seen_along
from clbrdf.viz.cut import plane_values
from clbrdf.viz.lobes import reference_values
from clbrdf.viz.page.still import still_figure
from clbrdf.viz.subject import Subject
from tests.viz.test_page_through import APERTURE, fit_through


@pytest.fixture(scope="module", params=[APERTURE, {**APERTURE, "bandwidth": {"width": 100.0}}])
def gloss(request):
    fit = fit_through(request.param)
    return Subject("gloss", fit.scan, fit)


def test_points_are_compared_with_what_is_seen(gloss):
    fit, rows = gloss.fit, np.array([3, 16, 40])
    seen = fit.observed()
    np.testing.assert_array_equal(gloss.seen_values(1, rows), seen[rows, 1])
    np.testing.assert_array_equal(gloss.seen_spectrum(16), seen[16])
    np.testing.assert_array_equal(reference_values(gloss, gloss, rows, 1), seen[rows, 1])
    assert np.abs(fit.evaluate()[:, 1] / seen[:, 1] - 1.0).max() > 0.05


def test_curves_pass_through_what_is_seen(gloss):
    """The nodes of a curve are of the highest order, those of points of the order that they need."""
    fit = gloss.fit
    rows = np.flatnonzero(
        (fit.scan.theta_i == 50.0) & (fit.scan.phi == 180.0) & (fit.through.levels[:, 1] == 6)
    )
    assert len(rows)
    expected = fit.observed()[rows, 1]
    np.testing.assert_allclose(seen_along(fit, fit.scan.directions[rows], 1), expected, rtol=1e-12)
    np.testing.assert_allclose(plane_values(gloss, 1, 50.0, fit.scan.theta_r[rows]), expected, rtol=1e-12)
    column = int(np.argmax(np.isclose(gloss.wavelength, 500.0)))
    axes = still_figure(gloss, 50.0, column).axes
    label = [one.get_title() for one in axes]
    assert "residual" in label
    assert "(measured − seen) / measured (%)" in [one.get_xlabel() for one in axes]


@pytest.mark.parametrize("effects", [APERTURE, {**APERTURE, "misalignment": {"tilt": 1.0, "height": 2.0}}])
def test_curves_end_where_the_detector_would_look_below_the_horizon(effects):
    fit = fit_through(effects)
    subject = Subject("gloss", fit.scan, fit)
    values = plane_values(subject, 1, 50.0, np.array([-89.9, -87.0, -80.0, 0.0, 80.0, 87.0, 89.9]))
    assert np.isfinite(values).tolist() == [False, False, True, True, True, False, False]
    assert np.isnan(plane_values(subject, 1, 89.9, np.array([89.0, 89.9]))).all()


def test_figures_say_so(gloss):
    assert model_word(gloss.fit) == "model as the detector sees it"
    assert "model as the detector sees it (lines)" in measured_and_model(gloss.fit).get_suptitle()

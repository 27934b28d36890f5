"""Flat figures: what is drawn is what was measured and fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import InputError, Scan
from clbrdf.fit import AnnealSettings
from clbrdf.viz.curves import measured_and_model, save_figure, signed_view_zenith, spectral_map


@pytest.fixture
def fit(small_scan):
    flags = np.zeros(small_scan.brdf.shape, np.uint32)
    flags[5, 1] = 1 << 3
    return clbrdf.fit(replace(small_scan, flags=flags), settings=AnnealSettings(chains=16, levels=8))


def test_points_lines_and_deviations(fit):
    figure = measured_and_model(fit, [550.0])
    top, bottom = figure.axes[0], figure.axes[3]
    points, masked, line = top.get_lines()
    here = fit.scan.theta_i == 30.0
    used = here & ~fit.scan.mask[:, 1]
    np.testing.assert_array_equal(points.get_ydata(), fit.scan.brdf[used, 1])
    np.testing.assert_array_equal(masked.get_xdata(), fit.scan.theta_r[[5]])
    on_line = np.interp(fit.scan.theta_r[used], line.get_xdata(), line.get_ydata())
    # 721 points on the line; the lobe bends between them by less than this.
    np.testing.assert_allclose(on_line, fit.evaluate()[used, 1], rtol=2e-3)
    expected = 100 * (fit.evaluate()[used, 1] / fit.scan.brdf[used, 1] - 1)
    np.testing.assert_allclose(bottom.get_lines()[0].get_ydata(), expected)
    assert top.get_title() == "θi = 30°"


def test_the_source_side_is_negative():
    scan = Scan([30.0] * 4, 0.0, [10.0, 20.0, 0.0, 20.0], [180.0, 0.0, 90.0, 90.0], [500.0], np.ones((4, 1)))
    np.testing.assert_array_equal(signed_view_zenith(scan), [10.0, -20.0, 0.0, np.nan])


def test_the_map_shows_measured_above_and_model_below(fit):
    figure = spectral_map(fit)
    measured, model = (figure.axes[k].collections[0].get_array() for k in (0, 3))
    here = fit.scan.theta_i == 30.0
    np.testing.assert_array_equal(
        np.ma.filled(measured, np.nan), np.where(fit.scan.mask, np.nan, fit.scan.brdf)[here]
    )
    np.testing.assert_allclose(model, fit.evaluate()[here])


def test_pictures_are_written_whole_in_the_format_of_their_name(fit, tmp_path):
    figure = measured_and_model(fit)
    save_figure(figure, tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    save_figure(figure, tmp_path / "a.svg")
    assert b"<svg" in (tmp_path / "a.svg").read_bytes()
    with pytest.raises(InputError, match="exists already"):
        save_figure(figure, tmp_path / "a.png")
    with pytest.raises(InputError, match=r"a\.doc: pictures end in"):
        save_figure(figure, tmp_path / "a.doc")


def test_nothing_in_the_plane_of_incidence_is_said(small_scan):
    turned = replace(small_scan, phi_r=np.full(48, 90.0), theta_r=small_scan.theta_r + 5.0)
    fit = clbrdf.fit(turned, settings=AnnealSettings(chains=16, levels=2))
    for draw in (measured_and_model, spectral_map):
        with pytest.raises(InputError, match="plane of incidence"):
            draw(fit)

"""The ranking on a page: sections, figures with the right lines, reports of a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import choose
from clbrdf.cli import main
from clbrdf.viz import write_report
from clbrdf.viz.residual_maps import residual_maps, shown_models
from clbrdf.viz.score_chart import score_chart
from tests.choose.made import MODELS, made


@pytest.fixture(scope="module")
def choice():
    return choose(made(), MODELS)


def test_scores_are_drawn_in_percent(choice):
    axes = score_chart(choice).axes[0]
    assert axes.get_yticklabels()[0].get_text() == "ggx+lambert (4)"
    assert axes.yaxis_inverted()
    bars = [bar.get_x() + bar.get_width() for bar in axes.patches]
    np.testing.assert_allclose(bars, [100.0 * row.predicted for row in choice.ranking], rtol=1e-9)
    for k, dots in enumerate(axes.collections):
        expected = 100.0 * np.sqrt([row.score[k].mean() for row in choice.ranking])
        np.testing.assert_allclose(dots.get_offsets()[:, 0], expected, rtol=1e-9)


def test_in_one_plane_residuals_are_lines(choice):
    figure = residual_maps(choice)
    assert len(figure.axes) == 4
    line = figure.axes[1].lines[0]
    scan = choice.scan
    here = scan.theta_i == 35.0
    signed = np.where(scan.phi == 0.0, -scan.theta_r, scan.theta_r)[here]
    expected = 100.0 * (choice.values("ggx+lambert") / scan.brdf - 1.0).mean(axis=1)[here]
    np.testing.assert_allclose(line.get_ydata(), expected[np.argsort(signed)], atol=1e-9)
    assert shown_models(choice)[0] == choice.chosen


def test_over_the_hemisphere_they_are_maps():
    made_scan = made()
    turned = replace(made_scan, phi_r=np.tile([0.0, 60.0, 120.0, 180.0], 31))
    found = choose(turned, ["lambert", "minnaert"])
    figure = residual_maps(found)
    assert len(figure.axes) == 2 * 4 + 1  # models × angles, and the colour bar
    dots = figure.axes[0].collections[0]
    here = turned.theta_i == 15.0
    across, up = dots.get_offsets().T
    np.testing.assert_allclose(np.hypot(across, up), turned.theta_r[here])
    forward = np.cos(np.deg2rad(turned.phi[here])) < -1e-9
    assert (across[forward & (turned.theta_r[here] > 0)] > 0.0).all()
    low, high = dots.get_clim()
    assert low == -high


def test_a_report_of_a_choice_begins_with_the_ranking(choice, tmp_path):
    files, _ = write_report(choice.fit, tmp_path / "report", choice=choice)
    text = files[0].read_text(encoding="utf-8")
    places = [text.index(f"<h2>{name}</h2>") for name in ("Choice of the model", "Where the models miss")]
    assert places == sorted(places)
    assert places[1] < text.index("<h2>Measured and model</h2>")
    assert "ggx+lambert predicts best" in text
    assert text.count("<h2>Choice of the model</h2>") == 1


def test_the_command_finds_the_ranking_in_the_file(choice, tmp_path, capsys):
    choice.save(tmp_path / "fit.h5")
    assert main(["report", str(tmp_path / "fit.h5"), "-o", str(tmp_path / "one")]) == 0
    assert "Choice of the model" in (tmp_path / "one" / "report.html").read_text(encoding="utf-8")
    choice.fit.save(tmp_path / "plain.h5")
    assert main(["report", str(tmp_path / "plain.h5"), "-o", str(tmp_path / "two")]) == 0
    assert "Choice of the model" not in (tmp_path / "two" / "report.html").read_text(encoding="utf-8")


def test_many_incident_angles_still_make_a_figure():
    scan = made()
    many = replace(scan, theta_i=scan.theta_i + np.tile(np.repeat([0.0, 2.0, 4.0], [10, 10, 11]), 4))
    found = choose(many, ["lambert", "minnaert"])
    assert len(found.theta_i) == 12
    assert len(residual_maps(found).axes) == 5
    assert len(score_chart(found).axes[0].collections) <= 7

"""Work-precision tables: errors are those of the arithmetic, and the figure shows every point."""

from __future__ import annotations

import json

import pytest

from clbrdf import Scan
from clbrdf.bench import accuracy
from clbrdf.bench.figure import accuracy_figure
from clbrdf.cli import main
from clbrdf.opencl.precision import PRECISIONS
from clbrdf.scans import sample_scan


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(accuracy, "FIT_SETTINGS", ((8, 3, "single"), (16, 8, "single")))


def test_values_keep_the_stated_bounds(device):
    panel = accuracy.value_panel(device)
    for point in panel.points:
        assert point.error <= PRECISIONS[point.name].bound
        assert point.seconds > 0.0
    errors = {(p.series, p.name): p.error for p in panel.points}
    assert errors["easy", "fast:3"] > errors["easy", "fast:5"] > errors["easy", "double"]


def test_objectives_gain_digits_with_precision(device):
    errors = {p.name: p.error for p in accuracy.objective_panel(device).points}
    # Near the optimum E is a small difference of large values: fp32 ends at about 1e-5.
    assert errors["fast:3"] > errors["fast:4"] > errors["single"]
    assert errors["double"] < 1e-12


def test_the_polish_closes_the_gap(device):
    scan = accuracy.some_wavelengths(Scan.open(sample_scan("yellow_tin_foil")), 3)
    panel = accuracy.fit_panel(device, scan)
    errors = {(p.series, p.name): p.error for p in panel.points}
    longest = "16 × 160"
    assert errors["alone, single", longest] > 1e-3
    assert errors["polished, single", longest] < errors["alone, single", longest]
    assert errors["dictionary", "two looks"] < 1e-9
    assert errors["dictionary", "alone"] > 1e-3


def test_graded_grids_meet_a_narrow_lobe_and_uniform_ones_miss_it(device):
    points = accuracy.integral_panel(device).points
    best = {p.series: min(q.error for q in points if q.series == p.series) for p in points}
    assert best["graded, 0.1° lobe"] < 1e-9
    assert best["graded, broad lobe"] < 1e-8
    assert best["uniform, 0.1° lobe"] > 0.1  # 0.1° steps still leave most of the light out


def test_the_command_prints_writes_and_draws(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("COLUMNS", "100")
    words = ["bench", "accuracy", "--png", str(tmp_path / "a.png"), "--json", str(tmp_path / "a.json")]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert all(f"({letter})" in out for letter in "abcd")
    assert max(len(line) for line in out.splitlines()) <= 100
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert len(json.loads((tmp_path / "a.json").read_text())["accuracy"]) == 4
    assert main(words) == 2
    assert main(["bench", "throughput", "--png", str(tmp_path / "b.png")]) == 2


def test_the_figure_has_every_series(device):
    panels = [accuracy.objective_panel(device)] * 4
    figure = accuracy_figure(panels, "a device")
    for axes in figure.axes:
        assert [text.get_text() for text in axes.get_legend().get_texts()] == ["E near the optimum"]
        assert len(axes.get_lines()[0].get_xdata()) == len(panels[0].points)

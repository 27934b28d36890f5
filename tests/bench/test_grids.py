"""The race of grids: scene and evaluate compute the same; every line is told beside its reference."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from clbrdf.bench import grids
from clbrdf.bench.grids import GridRun, grid_scene
from clbrdf.cli import main
from clbrdf.cli.bench_grids import ratio
from clbrdf.scene.simulate import set_up, values_of

SMALL = {
    "directions": {"theta_i": 45, "theta_r": [10, 45, 60], "phi_r": [90, 180], "region": "hemispherical"},
    "wavelength": [500, 550, 600],
}


def test_the_scene_and_evaluate_compute_the_same(device):
    setting = set_up(grid_scene(SMALL, "double"), device=device)
    np.testing.assert_array_equal(values_of(setting), grids._evaluated(setting, "double", device)())


def test_ratios_are_taken_round_by_round_in_one_precision():
    runs = [
        GridRun("in memory", "evaluate, single", 1, (1.0, 10.0, 1.0)),
        GridRun("in memory", "evaluate, double", 1, (5.0, 5.0, 5.0)),
        GridRun("in memory", "scene without effects, single", 1, (2.0, 20.0, 3.0)),
    ]
    assert ratio(runs[2], runs, "evaluate") == pytest.approx(2.0)


def test_the_command_prints_and_writes(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(grids, "ROUNDS", 1)
    monkeypatch.setattr(grids, "IN_MEMORY", SMALL)
    monkeypatch.setattr(grids, "TO_A_FILE", SMALL)
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["bench", "grids", "--json", str(tmp_path / "g.json")]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 100
    names = [row["name"] for row in json.loads((tmp_path / "g.json").read_text())["grids"]]
    assert {"kernel alone, fast:3", "scene to a file, single", "scene without effects, double"} <= set(names)


def test_peak_memory_is_that_of_the_process_itself():
    """Children of a process that has needed much: one that needs little, one that needs 160 MB more."""
    block = np.ones(40_000_000)
    code = "from clbrdf.bench.memory import peak_memory; {}; print(peak_memory())"
    little, much = (
        int(subprocess.run([sys.executable, "-c", code.format(work)], capture_output=True, check=True).stdout)
        for work in ("import numpy", "import numpy; numpy.ones(20_000_000)")
    )
    assert little < block.nbytes
    assert 150e6 < much - little < 200e6

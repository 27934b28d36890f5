"""Pictures for print, and the numbers behind a picture."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from clbrdf import InputError, evaluate
from clbrdf.cli import main
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.printed import save_printed
from clbrdf.viz.style import LobeStyle
from clbrdf.viz.values import NAMES, save_values
from tests.viz.conftest import FOIL


def test_values_are_those_measured_and_those_of_the_model(foil, tmp_path):
    count = save_values([LobeRequest(foil, 550.0, 45.0)], tmp_path / "a.csv")
    with open(tmp_path / "a.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == count
    assert tuple(rows[0]) == NAMES
    here = foil.rows(45.0)
    assert [float(r["measured_per_sr"]) for r in rows[:16]] == foil.scan.brdf[here, 1].tolist()
    for row in (*rows[:16], *rows[16::97]):
        angles = (float(row[f"{name}_deg"]) for name in ("theta_i", "theta_r", "phi"))
        assert float(row["model_per_sr"]) == pytest.approx(evaluate(FOIL, *angles)[0], rel=1e-10)
    assert max(float(r["theta_r_deg"]) for r in rows) == 85.0


@pytest.mark.parametrize("overlay", [False, True])
def test_pictures_for_print_are_whole(gl, foil, tmp_path, overlay):
    requests = [LobeRequest(foil, 550.0, a) for a in (45.0, 60.0)]
    for kind, head in (("svg", b"<?xml"), ("pdf", b"%PDF")):
        path = tmp_path / f"a.{kind}"
        save_printed(requests, LobeStyle(), path, size=(500, 400), overlay=overlay)
        assert path.read_bytes().startswith(head)
        with pytest.raises(InputError, match="exists already"):
            save_printed(requests, LobeStyle(), path, size=(500, 400))


def test_the_commands(gl, foil_file, tmp_path, capsys):
    words = ["view", str(foil_file), "--theta-i", "45", "--size", "400x300"]
    for kind in ("svg", "pdf", "csv"):
        words += [f"--{kind}", str(tmp_path / f"v.{kind}")]
    assert main(words) == 0
    assert all((tmp_path / f"v.{kind}").stat().st_size > 1000 for kind in ("svg", "pdf", "csv"))
    assert main(["report", str(foil_file), "-o", str(tmp_path / "r"), "--figures", "pdf"]) == 0
    made = {path.name for path in (tmp_path / "r").iterdir()}
    assert {"curves.pdf", "spectrum.pdf", "parameters.pdf", "quality.pdf"} <= made
    capsys.readouterr()
    assert main(["view", str(foil_file), "--svg", str(tmp_path / "v.png")]) == 2
    assert "--svg writes .svg files" in capsys.readouterr().err
    assert main(["report", str(foil_file), "-o", str(tmp_path / "p.html"), "--figures", "svg"]) == 2
    assert np.size(capsys.readouterr().err.splitlines()) == 1

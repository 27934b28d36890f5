"""The demo, with a small fit in place of the long one."""

from __future__ import annotations

import sys

from clbrdf import Fit, Scan
from clbrdf.scans import sample_scan


def test_demo_leaves_scan_fit_and_pictures(run, tmp_path, monkeypatch):
    scan = Scan.open(sample_scan("yellow_tin_foil")).columns([10, 80, 150])
    scan.save(tmp_path / "small.h5")
    monkeypatch.setattr(sys.modules["clbrdf.demo"], "sample_scan", lambda name: tmp_path / "small.h5")
    status, out, err = run("demo", "-o", tmp_path / "demo")
    assert (status, err) == (0, "")
    left = {path.name for path in (tmp_path / "demo").iterdir()}
    assert left == {"scan.h5", "fit.h5", "curves.png", "spectrum.png"}
    assert all(name in out for name in left)
    assert Fit.open(tmp_path / "demo" / "fit.h5").provenance["weights"] == "sigma"
    status, _, err = run("demo", "-o", tmp_path / "demo")
    assert status == 2
    assert "scan.h5: exists already" in err
    assert run("demo", "-o", tmp_path / "demo", "--overwrite")[0] == 0


def test_demo_folder_that_cannot_be_made(run, tmp_path):
    (tmp_path / "file").write_text("")
    status, _, err = run("demo", "-o", tmp_path / "file" / "demo")
    assert status == 2
    assert "cannot be made" in err

"""The demo: a measurement on the emulated rig, its fit, pictures."""

from __future__ import annotations

import numpy as np

from clbrdf import Fit, Scan
from clbrdf.bench.hard_cases import TIN_FOIL


def test_demo_leaves_scan_fit_and_pictures(run, tmp_path):
    status, out, err = run("demo", "-o", tmp_path / "demo")
    assert (status, err) == (0, "")
    left = {path.name for path in (tmp_path / "demo").iterdir()}
    assert {"scan.h5", "fit.h5", "curves.png", "spectrum.png", "report.html"} <= left
    assert all(name in out for name in left)
    assert "brdf.html" in left
    assert "lobes.png" in left or "no lobes: " in out
    fit = Fit.open(tmp_path / "demo" / "fit.h5")
    assert fit.provenance["weights"] == "sigma"
    assert fit.scan.sigma is not None
    assert Scan.open(tmp_path / "demo" / "scan.h5").brdf.tobytes() == fit.scan.brdf.tobytes()
    # The surface measured is Table 1's: c and d come back within the rig's uncertainty of a few percent.
    assert np.median(fit.parameters["d"]) == np.clip(np.median(fit.parameters["d"]), 0.72, 0.76)
    assert abs(np.median(fit.parameters["c"]) / TIN_FOIL["c"] - 1.0) < 0.1
    status, _, err = run("demo", "-o", tmp_path / "demo")
    assert status == 2
    assert "scan.h5: exists already" in err


def test_demo_folder_that_cannot_be_made(run, tmp_path):
    (tmp_path / "file").write_text("")
    status, _, err = run("demo", "-o", tmp_path / "file" / "demo")
    assert status == 2
    assert "cannot be made" in err

"""Uncertainties from columns and options, as components."""

import numpy as np
import pytest

from clbrdf.cli import main
from clbrdf.scan import Scan

TABLE = """wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr,fr_std_per_sr,fr_std_common_per_sr
550,30,0,180,0.30,0.003,0.006
550,30,20,180,0.32,0.003,0.0064
550,30,30,180,0.34,,0.0068
"""


def imported(tmp_path, *options, table=TABLE):
    (tmp_path / "a.csv").write_text(table)
    assert (
        main(["import", str(tmp_path / "a.csv"), "-o", str(tmp_path / "a.h5"), "--overwrite", *options]) == 0
    )
    return Scan.open(tmp_path / "a.h5")


def test_columns_and_options_become_components(tmp_path):
    scan = imported(tmp_path, "--scale-uncertainty", "panel=2%", "--scale-uncertainty", "lamp=0.01")
    assert [one.name for one in scan.components] == [
        "stated uncertainty",
        "stated common uncertainty",
        "panel",
        "lamp",
    ]
    assert scan.random_sigma[:2] == pytest.approx(0.003)
    # No uncertainty is stated for the third value.
    assert np.isnan(scan.sigma[2, 0])
    assert scan.sigma[0, 0] == pytest.approx(np.sqrt(0.003**2 + (0.02**2 + 0.02**2 + 0.01**2) * 0.3**2))


def test_options_alone(tmp_path):
    bare = "\n".join(",".join(line.split(",")[:5]) for line in TABLE.splitlines()) + "\n"
    scan = imported(tmp_path, "--scale-uncertainty", "2%", "--random-uncertainty", "0.5%", table=bare)
    assert [(one.name, one.words()) for one in scan.components] == [
        ("noise", "noise: every value for itself"),
        ("scale", "one error for all values"),
    ]
    assert scan.sigma == pytest.approx(scan.brdf * np.hypot(0.02, 0.005))


def test_exported_columns_keep_both_parts(tmp_path):
    scan = imported(tmp_path, "--scale-uncertainty", "panel=1%")
    out = tmp_path / "b.csv"
    assert main(["export", str(tmp_path / "a.h5"), "-o", str(out), "--format", "columns"]) == 0
    again = imported(tmp_path, table=out.read_text())
    assert again.sigma == pytest.approx(scan.sigma, nan_ok=True)
    assert again.random_sigma == pytest.approx(scan.random_sigma, nan_ok=True)


@pytest.mark.parametrize("text", ["2", "0%", "two", "panel=120%", "panel="])
def test_an_uncertainty_that_is_none_is_refused(tmp_path, capsys, text):
    (tmp_path / "a.csv").write_text(TABLE)
    options = ["-o", str(tmp_path / "a.h5"), "--scale-uncertainty", text]
    assert main(["import", str(tmp_path / "a.csv"), *options]) == 2
    assert "as in --scale-uncertainty 2%" in capsys.readouterr().err

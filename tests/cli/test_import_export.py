"""Files in and out by the command line: options, provenance, tables, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import Scan
from clbrdf.formats.load import load_one
from tests.cli.test_commands import assert_one_line
from tests.formats import made_files as made


@pytest.fixture
def put(tmp_path):
    def write(name, content):
        path = tmp_path / name
        path.write_text(content, encoding="utf-8")
        return path

    return write


def test_a_made_file_of_another_format(run, put, tmp_path):
    out_file = tmp_path / "scan.h5"
    status, out, err = run("import", put("a.txt", made.fred()), "-o", out_file)
    assert (status, err) == (0, "")
    assert "forward is φ = 180°" in out
    scan = Scan.open(out_file)
    assert scan.bands == ("monochrome",)
    assert any(key.startswith("guard_") and key.endswith("_forward") for key in scan.provenance)
    assert "monochrome" in run("info", out_file)[1]


def test_what_the_guard_asks_is_an_option_of_the_command(run, put, tmp_path):
    path = put("a.xompt", made.openmaterial(forward=9.0))
    result = run("import", path, "-o", tmp_path / "x.h5")
    assert_one_line(result, "settle it with --phi-forward 0 or --phi-forward 180")
    assert run("import", path, "-o", tmp_path / "x.h5", "--phi-forward", "0")[0] == 0
    assert "--phi-forward 0" in Scan.open(tmp_path / "x.h5").provenance["command"]


def test_options_reach_the_guard(run, put, tmp_path):
    words = ("--wavelength", "633", "--scale", "pi", "--unit", "deg", "--unit", "nm", "--cosine", "none")
    status, _, err = run("import", put("a.txt", made.fred()), "-o", tmp_path / "x.h5", *words)
    assert (status, err) == (0, "")
    scan = Scan.open(tmp_path / "x.h5")
    assert scan.wavelength.tolist() == [633.0]
    assert scan.brdf.min() == pytest.approx(made.F / np.pi)
    result = run(
        "import", put("b.txt", made.fred()), "-o", tmp_path / "y.h5", "--unit", "deg", "--unit", "rad"
    )
    assert_one_line(result, "exclude each other")


def test_several_samples_become_scans_by_name(run, put, tmp_path):
    path = tmp_path / "klems.h5"
    status, out, _ = run("import", put("a.xml", made.klems()), "-o", path)
    assert status == 0
    assert "named as in klems.h5::blind_front" in out
    status, out, _ = run("info", path)
    assert status == 0
    assert "blind_back" in out
    status, out, _ = run("info", f"{path}::blind_front")
    assert "of transmission" in out
    assert_one_line(run("fit", path, "-o", tmp_path / "f.h5"), "holds 2 scans; name one of them")
    one = run("import", put("b.xml", made.klems()), "-o", tmp_path / "one.h5", "--sample", "blind back")
    assert one[0] == 0
    assert Scan.open(tmp_path / "one.h5").sample == "blind back"
    assert_one_line(
        run("import", put("c.xml", made.klems()), "-o", tmp_path / "z.h5", "--sample", "wood"),
        "no sample is called 'wood'; there are 'blind front', 'blind back'",
    )


def test_an_unknown_format_and_the_list_of_them(run, put, tmp_path):
    result = run("import", put("a.txt", made.fred()), "-o", tmp_path / "x.h5", "--format", "wavefront")
    assert_one_line(result, "no format is called 'wavefront'; there are", "columns")
    status, out, _ = run("formats")
    assert status == 0
    for name in ("zemax", "ssdd", "window", "bird", "merl"):
        assert name in out


@pytest.mark.parametrize("ending", [".csv", ".wide.csv", ".json", ".ssdd", ".astm"])
def test_a_scan_leaves_and_comes_back(run, put, tmp_path, ending):
    scan_file = tmp_path / "scan.h5"
    run("import", put("a.csv", made.long_csv()), "-o", scan_file)
    out_file = tmp_path / f"out{ending}"
    status, out, err = run("export", scan_file, "-o", out_file)
    assert (status, err) == (0, "")
    assert "as measured" in out
    assert ("not kept" in out) == (ending in (".wide.csv", ".ssdd", ".astm"))
    back, scan = load_one([out_file]), Scan.open(scan_file)
    if ending == ".ssdd":
        # On a grid the normal is one direction, and not one for each azimuth.
        scan = scan.rows((scan.theta_r > 0.0) | (scan.phi_r == 0.0))
    assert back.brdf.shape == scan.brdf.shape
    assert np.sort(back.brdf.ravel()) == pytest.approx(np.sort(scan.brdf.ravel()), rel=1e-7)
    assert_one_line(run("export", scan_file, "-o", out_file), "exists already")


def test_parts_of_a_scan_and_what_does_not_fit(run, put, tmp_path):
    scan_file = tmp_path / "scan.h5"
    run("import", put("a.csv", made.long_csv()), "-o", scan_file)
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "a.binary"), "MERL files hold R, G and B", "--rgb"
    )
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "a.bsdf", "--format", "zemax"),
        "holds one wavelength",
        "--wavelength",
    )
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "a.xyz"), "no format writes files of this ending"
    )
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "b.csv", "--side", "transmission"), "no such direction"
    )
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "b.csv", "--phi-i", "30"), "no such incident azimuth"
    )
    assert_one_line(
        run("export", scan_file, "-o", tmp_path / "b.csv", "--tolerance", "x"), "no positive number"
    )
    assert not list(tmp_path.glob("a.b*"))
    status, _, _ = run("export", scan_file, "-o", tmp_path / "one.csv", "--wavelength", "450")
    assert status == 0
    assert load_one([tmp_path / "one.csv"]).wavelength.tolist() == [450.0]

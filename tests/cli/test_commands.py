"""Commands as a user gives them: what they print, write and refuse."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import h5py
import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, Scan
from clbrdf.cli import COMMANDS
from clbrdf.cli.help import joined
from tests.cli.conftest import assert_one_line

FAST = ("--method", "anneal", "--chains", 16, "--levels", 8)


@pytest.fixture
def csv_file(tmp_path):
    rows = [f"foil,{w},30,{t},180,{1 + t / 10},," for w in (450, 550) for t in range(0, 80, 5)]
    header = "sample,wavelength_nm,theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr,fr_std_per_sr,flag"
    (tmp_path / "data.csv").write_text("\n".join([header, *rows]) + "\n")
    return tmp_path / "data.csv"


def csv_of(folder, columns, rows):
    path = folder / "table.csv"
    path.write_text("\n".join([columns, *rows]) + "\n")
    return path


class TestImport:
    """What a file lacks or claims, as somebody sees it who wrote the file."""

    ANGLES = "theta_i_deg,theta_r_deg,dphi_deg,fr_per_sr"
    ROWS = tuple(f"30,{t},180,{0.2 + t / 100}" for t in range(0, 80, 5))

    def test_a_file_of_one_wavelength_is_told_it(self, run, tmp_path):
        path, target = csv_of(tmp_path, self.ANGLES, self.ROWS), tmp_path / "scan.h5"
        assert_one_line(run("import", path, "-o", target), "names no wavelength", "--wavelength")
        assert run("import", path, "-o", target, "--wavelength", 633)[0] == 0
        scan = Scan.open(target)
        assert scan.wavelength.tolist() == [633.0]
        assert len(scan) == len(self.ROWS)

    def test_micrometres_under_a_heading_of_nm(self, run, tmp_path):
        rows = [f"0.{w},{row}" for w in (45, 55) for row in self.ROWS]
        path = csv_of(tmp_path, f"wavelength_nm,{self.ANGLES}", rows)
        out = run("import", path, "-o", tmp_path / "scan.h5")[1]
        assert "µm (the file says nm; 0.45 to 0.55 is no light in nm)" in " ".join(out.split())

    def test_repeats_that_differ_are_told(self, run, tmp_path):
        rows = [f"550,{row}" for row in (*self.ROWS, "30,0,180,0.4")]
        path = csv_of(tmp_path, f"wavelength_nm,{self.ANGLES}", rows)
        out = run("import", path, "-o", tmp_path / "scan.h5")[1]
        assert "1 of them repeats, whose values differ by up to 50 %" in " ".join(out.split())

    def test_nothing_to_be_fitted_is_told(self, run, tmp_path):
        rows = [f"550,30,{t},180," for t in range(0, 80, 5)]
        path = csv_of(tmp_path, f"wavelength_nm,{self.ANGLES}", rows)
        out = run("import", path, "-o", tmp_path / "scan.h5")[1]
        assert "nothing: every value is masked" in " ".join(out.split())

    def test_mistakes_in_a_table(self, run, tmp_path):
        target = tmp_path / "scan.h5"

        def refused(columns, rows, *words):
            assert_one_line(run("import", csv_of(tmp_path, columns, rows), "-o", target), *words)

        refused("550,30,0,180,0.2", ["550,30,5,180,0.2"], "the first line holds numbers")
        refused("w_nm,in,out,dphi_deg,fr_per_sr", ["550,30,5,180,0.2"], "no column for theta_i", "--map")
        refused(self.ANGLES, ["30,0,180,20%"], "'20%' is not a number; leave out the %", "--scale")
        path = csv_of(tmp_path, f"wavelength_nm,{self.ANGLES}", [f"550,{row}" for row in self.ROWS])
        assert_one_line(run("import", path, path, "-o", target), "is given twice")


class TestEvaluate:
    ANGLES = ("--theta-i", "30,45,60", "--theta-r", "30,45,60", "--phi", "180")

    def test_table_1(self, run):
        status, out, err = run("evaluate", *self.ANGLES)
        assert (status, err) == (0, "")
        assert [line.split()[-1] for line in out.splitlines()[-4:-1]] == ["350.8296", "657.6042", "1996.721"]

    def test_parameters_and_json(self, run, tmp_path):
        tile = ["a=7.9678", "b=0.5555", "c=-180", "ks=190.5,kd=1.8667"]
        words = [word for text in tile for word in ("--param", text)]
        status, _, _ = run("evaluate", *self.ANGLES, *words, "--json", tmp_path / "values.json")
        assert status == 0
        values = json.loads((tmp_path / "values.json").read_text())
        np.testing.assert_allclose(values["brdf"], [201.8846, 291.8941, 861.6960], rtol=1e-6)
        assert values["parameters"]["c"] == -180.0

    def test_grid_and_ranges(self, run):
        status, out, _ = run("evaluate", "--theta-i", "30,60", "--theta-r", "0:10:5", "--grid")
        assert status == 0
        assert len(out.splitlines()) == 3 + 6 + 1

    def test_long_results_stream_in_columns(self, run):
        status, out, _ = run("evaluate", "--theta-i", "60", "--theta-r", "0:85:0.02")
        lines = out.splitlines()
        assert (status, len(lines)) == (0, 4252)
        assert lines[3001].split() == ["60", "60", "180", "1996.721"]

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("--theta-i", "90", "--theta-r", "0"), "theta_i[0] is 90°"),
            (("--theta-i", "x", "--theta-r", "0"), "--theta-i: 'x' is neither a number nor start:stop:step"),
            (("--theta-i", "0:10:-1", "--theta-r", "0"), "is empty in steps of -1"),
            (("--theta-i", "0:80:1e-9", "--theta-r", "0"), "at most 1000000"),
            (
                ("--theta-i", "1,2", "--theta-r", "1,2,3"),
                "2 of --theta-i and 3 of --theta-r; give lists of one length",
            ),
            (("--theta-i", "1", "--theta-r", "1", "--param", "ks"), "write name=number"),
            (("--theta-i", "1", "--theta-r", "1", "--param", "k=1"), "no parameter 'k'"),
            (("--theta-i", "1"), "--theta-r"),
            (("--theta-i", "1", "--theta-r", "1", "--precision", "half"), "half"),
            (
                ("--theta-i", "1", "--theta-r", "1", "--device", "Abacus"),
                "no OpenCL device is called 'Abacus'",
            ),
        ],
    )
    def test_mistakes(self, run, words, said):
        assert_one_line(run("evaluate", *words), said)


class TestImportAndInfo:
    def test_there_and_shown(self, run, csv_file, tmp_path):
        status, out, err = run("import", csv_file, "-o", tmp_path / "scan.h5")
        assert (status, err) == (0, "")
        assert "2 from 450 to 550 nm" in out
        status, again, _ = run("info", tmp_path / "scan.h5")
        assert status == 0
        assert again == out
        assert Scan.open(tmp_path / "scan.h5").brdf.shape == (16, 2)

    def test_mistakes(self, run, csv_file, tmp_path, scan_file):
        assert_one_line(run("import", tmp_path / "no.csv", "-o", tmp_path / "x.h5"), "no.csv: no such file")
        assert_one_line(run("import", csv_file, "-o", scan_file), "scan.h5: exists already", "--overwrite")
        assert_one_line(
            run("import", csv_file, "-o", tmp_path / "x.h5", "--sample", "wood"), "'wood'", "'foil'"
        )
        csv_file.write_text(csv_file.read_text().replace("1.5", "bright"))
        assert_one_line(
            run("import", csv_file, "-o", tmp_path / "x.h5"), "line 3, column fr_per_sr", "'bright'"
        )
        assert not (tmp_path / "x.h5").exists()
        assert_one_line(
            run("info", csv_file), "not an HDF5 file; bring measured text in with 'clbrdf import'"
        )

    def test_truncated(self, run, scan_file):
        scan_file.write_bytes(scan_file.read_bytes()[:3000])
        assert_one_line(run("info", scan_file), "scan.h5: truncated HDF5 file")

    def test_newer_version(self, run, scan_file):
        with h5py.File(scan_file, "a") as file:
            file.attrs["clbrdf_format"] = 99
        assert_one_line(run("info", scan_file), "format version 99, newer than the 2 known here")


class TestFit:
    def test_table_file_and_json_agree(self, run, scan_file, tmp_path):
        words = ("fit", scan_file, "-o", tmp_path / "fit.h5", "--json", tmp_path / "fit.json", *FAST)
        status, out, err = run(*words)
        assert (status, err) == (0, "")
        fit, content = Fit.open(tmp_path / "fit.h5"), json.loads((tmp_path / "fit.json").read_text())
        assert content["parameters"]["d"] == fit.parameters["d"].tolist()
        assert content["seconds"] > 0.0
        assert content["status"] == fit.status.tolist()
        assert len(content["relative_rms_by_incident_angle"]) == 3
        assert all(word in out for word in ("λ (nm)", "ks", "E", "σr 30°", "status"))
        assert max(len(line) for line in out.splitlines()) <= 100
        first = next(line.split() for line in out.splitlines() if line.split()[:1] == ["450"])
        value, digits = first[4].rstrip(")").split("(")
        assert float(value) == pytest.approx(
            fit.parameters["d"][0], abs=0.51 * 10.0 ** -len(value.split(".")[1])
        )
        assert int(digits) == round(fit.sigma["d"][0] * 10.0 ** len(value.split(".")[1]))
        assert {"input_0_sha256", "version", "command", "weights"} <= fit.provenance.keys()

    def test_same_seed_same_bytes(self, run, scan_file, tmp_path):
        for name in ("a.h5", "b.h5"):
            run("fit", scan_file, "-o", tmp_path / name, "--seed", 7, *FAST)
        assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()

    def test_info_shows_a_fit(self, run, scan_file, tmp_path):
        run("fit", scan_file, "-o", tmp_path / "fit.h5", "--weights", "sigma", *FAST)
        status, out, _ = run("info", tmp_path / "fit.h5")
        assert status == 0
        assert "weights sigma" in out
        assert "converged" in out

    def test_weights_from_a_file(self, run, scan_file, small_scan, tmp_path):
        rows = [
            f"{i},{r},{p},{1 if i > 40 else 0}"
            for i, r, p in zip(small_scan.theta_i, small_scan.theta_r, small_scan.phi, strict=True)
        ]
        weights = tmp_path / "weights.csv"
        weights.write_text("theta_i_deg,theta_r_deg,dphi_deg,weight\n" + "\n".join(rows) + "\n")
        status, _, _ = run("fit", scan_file, "-o", tmp_path / "fit.h5", "--weights", weights, *FAST)
        assert status == 0
        fit = Fit.open(tmp_path / "fit.h5")
        assert (fit.setup.weights[:, 0] == (small_scan.theta_i > 40.0)).all()
        for text, said in (
            ("theta_i_deg,weight\n1,1\n", "no column theta_r_deg"),
            (
                "theta_i_deg,theta_r_deg,dphi_deg,weight\n30,77,180,1\n",
                "line 2: the scan has no direction 30°, 77°",
            ),
            (
                "theta_i_deg,theta_r_deg,dphi_deg,weight\n30,0,180,x\n",
                "line 2, column weight: 'x' is not a number",
            ),
            (
                "theta_i_deg,theta_r_deg,dphi_deg,weight\n30,0,inf,1\n",
                "line 2: direction 30°, 0°, inf° is not finite",
            ),
            (
                "theta_i_deg,theta_r_deg,dphi_deg,weight\n30,0,180,1\n30,0,180,1\n",
                "line 3: direction 30°, 0°, 180°",
            ),
        ):
            weights.write_text(text)
            result = run("fit", scan_file, "-o", tmp_path / "x.h5", "--weights", weights, *FAST)
            assert_one_line(result, "weights.csv", said)

    def test_mistakes(self, run, scan_file, csv_file, tmp_path):
        target = tmp_path / "fit.h5"
        assert_one_line(run("fit", tmp_path / "no.h5", "-o", target), "no.h5: no such file")
        assert_one_line(run("fit", csv_file, "-o", target), "data.csv: not an HDF5 file")
        assert_one_line(run("fit", scan_file, "-o", csv_file), "data.csv: exists already")
        assert_one_line(run("fit", scan_file, "-o", target, "--json", csv_file), "data.csv: exists already")
        assert_one_line(run("fit", scan_file, "-o", target, "--method", "guess"), "'guess'")
        assert_one_line(run("fit", scan_file, "-o", target, "--weights", "heavy"), "weights 'heavy'")
        assert_one_line(run("fit", scan_file, "-o", target, "--bounds", "d=2"), "write name=lower:upper")
        assert_one_line(run("fit", scan_file, "-o", target, "--bounds", "d=2:1"), "bounds of d")
        assert_one_line(run("fit", scan_file, "-o", target, "--device", "Abacus"), "'Abacus'")
        assert_one_line(run("fit", scan_file, "-o", target, "--seed", "-1"), "seed is -1")
        assert not target.exists()

    def test_all_rows_flagged(self, run, csv_file, tmp_path):
        csv_file.write_text(csv_file.read_text().replace(",,", ",,saturated"))
        run("import", csv_file, "-o", tmp_path / "flagged.h5")
        result = run("fit", tmp_path / "flagged.h5", "-o", tmp_path / "fit.h5")
        assert_one_line(result, "nothing to fit: all 32 values are masked (saturated 32)")

    def test_one_direction_and_constant_data_end_in_a_table(self, run, tmp_path):
        Scan([30.0], 0.0, [30.0], 180.0, [550.0], [[2.0]]).save(tmp_path / "one.h5")
        angles = np.arange(0.0, 80.0, 5.0)
        Scan(np.full(16, 30.0), 0.0, angles, 180.0, [550.0], np.ones((16, 1))).save(tmp_path / "flat.h5")
        for name in ("one", "flat"):
            status, out, err = run("fit", tmp_path / f"{name}.h5", "-o", tmp_path / f"{name}_fit.h5", *FAST)
            assert (status, err) == (0, "")
            assert "ambiguous" in out or "at bound" in out


class TestMistakesOfNewUsers:
    def test_outputs_and_inputs_are_files_of_their_own(self, run, scan_file, csv_file, tmp_path):
        before = csv_file.read_bytes()
        said = "is another file of this command"
        assert_one_line(run("import", csv_file, "-o", csv_file, "--overwrite"), "data.csv", said)
        assert csv_file.read_bytes() == before
        assert_one_line(run("fit", scan_file, "-o", scan_file, "--overwrite"), "scan.h5", said)
        out = tmp_path / "x.h5"
        assert_one_line(run("fit", scan_file, "-o", out, "--json", out), "x.h5", said)
        assert not out.exists()

    def test_devices_and_links(self, run, scan_file, csv_file, tmp_path):
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        assert_one_line(
            run("import", csv_file, "-o", pipe, "--overwrite"), "is a device or a pipe; name a file"
        )
        assert pipe.is_fifo()
        link = tmp_path / "link.h5"
        link.symlink_to(tmp_path / "real.h5")
        assert run("import", csv_file, "-o", link)[0] == 0
        assert link.is_symlink()
        assert Scan.open(tmp_path / "real.h5").sample == "foil"

    def test_a_full_disk_under_standard_output(self):
        words = [sys.executable, "-m", "clbrdf.cli", "evaluate", "--theta-i", "30", "--theta-r", "30"]
        ended = subprocess.run(
            f"{shlex.join(words)} >/dev/full", shell=True, capture_output=True, text=True, timeout=120
        )
        assert ended.returncode == 2
        assert ended.stderr.startswith("clbrdf: standard output: No space left")
        assert ended.stderr.count("\n") == 1

    @pytest.mark.parametrize("factor", [1e-300, 1e290])
    def test_values_beyond_all_surfaces(self, run, small_scan, tmp_path, factor):
        replace(small_scan, brdf=small_scan.brdf * factor, sigma=None).save(tmp_path / "s.h5")
        assert_one_line(run("fit", tmp_path / "s.h5", "-o", tmp_path / "f.h5"), "check the unit of the data")
        assert not (tmp_path / "f.h5").exists()

    def test_arguments(self, run, scan_file, tmp_path):
        target = tmp_path / "f.h5"
        fit = ("fit", scan_file, "-o", target)
        assert_one_line(run(*fit, "--method", "anneal", "--chains", 0), "chains is 0")
        assert_one_line(run(*fit, "--seed", "1.5"), "1.5")
        assert_one_line(run(*fit, "--rtol", "inf"), "rtol is inf; give 1e-09 to 1")
        assert_one_line(run(*fit, "--weights", scan_file), "scan.h5: not a text file (byte 6 is 26)")
        assert_one_line(run(*fit, "--bounds", "a=1:2", "--bounds", "a=2:3"), "a is given twice")
        angles = ("evaluate", "--theta-i", "30", "--theta-r", "30")
        assert_one_line(run(*angles, "--param", "ks=-1"), "parameter ks is -1; it has to be at least 0")
        assert_one_line(run(*angles, "--param", "ks=1,ks=2"), "ks is given twice")
        assert_one_line(run(*angles, "--rtol", "nan"), "give a positive number")
        assert_one_line(run(*angles, "--precision", "foo"), "reference")
        status, out, err = run(*angles, "--param", "ks=1e39", "--precision", "fast")
        assert (status, err) == (0, "")
        assert "e+3" in out

    def test_wavelengths_in_another_unit(self, run, csv_file, tmp_path):
        csv_file.write_text(csv_file.read_text().replace("foil,450", "foil,0.45"))
        result = run("import", csv_file, "-o", tmp_path / "x.h5")
        assert_one_line(result, "line 2", "0.45 is no wavelength of light in this unit", "wavelength_um")

    def test_numbers_are_never_cut_in_a_narrow_terminal(self, run, scan_file, tmp_path, monkeypatch):
        monkeypatch.setenv("COLUMNS", "60")
        run("fit", scan_file, "-o", tmp_path / "f.h5", *FAST)
        status, out, _ = run("info", tmp_path / "f.h5")
        assert status == 0
        table = out[out.index("λ (nm)") : out.index("method")]
        assert "…" not in table

    def test_what_a_new_user_forgets_is_named(self, run, scan_file, tmp_path):
        assert_one_line(run("fit", scan_file), "--output is missing; 'clbrdf fit --help' shows")
        assert_one_line(run("fit", "-o", tmp_path / "fit.h5"), "SCAN is missing; 'clbrdf fit --help' shows")
        assert_one_line(run("fit", scan_file, "-o"), "-o has no value; 'clbrdf fit --help' shows")
        out = "-o", tmp_path / "new.h5"
        assert_one_line(run("fit", scan_file, *out, "--model", "ggx+minaert"), "(did you mean minnaert?)")
        assert_one_line(run("fit", scan_file, *out, "--fix", "a=abc"), "abc: neither a number nor a file")
        assert_one_line(run("import", scan_file, *out), "scans and fits of clbrdf need no import")
        assert_one_line(run("simulate", scan_file, *out), "cannot be read as text, which a TOML file is")
        assert_one_line(run("report", scan_file, "-o", tmp_path / "out"), "; fit it with 'clbrdf fit'")

    def test_help_tells_what_the_readme_promises(self, run):
        assert "wavelength_nm" in run("import", "--help")[1]
        assert "0:85:5" in run("evaluate", "--help")[1]


def test_devices(run):
    status, out, _ = run("devices")
    assert status == 0
    assert out.count("*") == 1
    assert_one_line(run("devices", "--device", "Abacus"), "'Abacus'")


def test_more_arguments_than_a_command_takes(run):
    assert_one_line(run("info", "a.h5", "b.h5"), "b.h5: more than 'clbrdf info' takes", "--help")


def test_a_grid_larger_than_memory(run):
    words = ("--theta-i", "0:89:0.001", "--theta-r", "0:89:0.001", "--grid")
    assert_one_line(run("evaluate", *words), "--grid: 7921178001 directions", "clbrdf simulate")


def test_help_and_version(run):
    status, out, _ = run("--version")
    assert (status, out.strip()) == (0, clbrdf.__version__)
    for command in ("import", "info", "fit", "evaluate", "devices", "demo"):
        status, out, _ = run(command, "--help")
        assert status == 0
        assert "Usage: clbrdf" in out


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fills_its_lines(run, name):
    """A line inside a paragraph ends only where the next word would not have stood on it."""
    _, out, _ = run(name, "--help")
    inside = [line.strip("│ ") for line in out.split("╭")[0].splitlines()[1:]]
    for line, following in pairwise(inside):
        if line and following and not line.endswith((";", ":")):
            assert len(line) + 1 + len(following.split()[0]) > 100, line


def test_paragraphs_and_lists_are_kept():
    assert joined("one\ntwo\n\nthree") == "one two\n\nthree"
    assert joined("a: first;\nb: second\nand more") == "a: first;\nb: second and more"


def test_unknown_command(run):
    assert_one_line(run("fitt"), "fitt")
    assert_one_line(run("fit"), "SCAN")

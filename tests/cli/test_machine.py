"""What needs a process of its own: a machine that lacks something, signals, readers that leave."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys

import pytest

from clbrdf.opencl.device import choose_device
from clbrdf.scans import sample_scan
from tests.cli.conftest import assert_one_line


class TestMachine:
    def start(self, *words, **environment):
        return subprocess.run(
            [sys.executable, "-m", "clbrdf.cli", *map(str, words)],
            capture_output=True,
            text=True,
            env={**os.environ, **environment},
            timeout=120,
        )

    def test_no_opencl_platform(self, scan_file, tmp_path):
        # The loader looks for runtimes in this folder only, and it does not exist.
        nowhere = str(tmp_path / "vendors")
        ended = self.start("fit", scan_file, "-o", tmp_path / "fit.h5", OCL_ICD_VENDORS=nowhere)
        assert_one_line(
            (ended.returncode, ended.stdout, ended.stderr), "no OpenCL platform found", "pip install"
        )
        assert not (tmp_path / "fit.h5").exists()

    def test_a_home_that_cannot_be_written(self, scan_file, tmp_path):
        """PoCL then gives a platform without a device: its cache is what has to be mended."""
        if choose_device().kind == "gpu":
            pytest.skip("a GPU is preferred to PoCL here")
        (tmp_path / "file").write_text("no folder")
        home = {"HOME": str(tmp_path / "file"), "POCL_CACHE_DIR": "", "XDG_CACHE_HOME": ""}
        ended = self.start("fit", scan_file, "-o", tmp_path / "fit.h5", **home)
        told = ended.returncode, ended.stdout, ended.stderr
        assert_one_line(told, f"{tmp_path}/file/.cache/pocl", "set POCL_CACHE_DIR")

    def test_a_home_that_pyopencl_cannot_write(self, scan_file, tmp_path):
        """A GPU's runtime, and PoCL with a cache of its own, give a device all the same."""
        (tmp_path / "file").write_text("no folder")
        own = str(tmp_path / "pocl")
        home = {"HOME": str(tmp_path / "file"), "POCL_CACHE_DIR": own, "XDG_CACHE_HOME": ""}
        ended = self.start("fit", scan_file, "-o", tmp_path / "fit.h5", **home)
        told = ended.returncode, ended.stdout, ended.stderr
        assert_one_line(told, f"{tmp_path}/file/.cache/pytools", "set XDG_CACHE_HOME")

    def test_interrupt_leaves_nothing(self, tmp_path):
        import signal
        import time

        target = tmp_path / "fit.h5"
        words = ("fit", sample_scan("yellow_tin_foil"), "-o", target, "--method", "anneal", "--levels", 3000)
        process = subprocess.Popen(
            [sys.executable, "-m", "clbrdf.cli", *map(str, words)], stderr=subprocess.PIPE, text=True
        )
        time.sleep(3.0)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 130
        assert err.splitlines() == ["clbrdf: interrupted; nothing was left half-written"]
        assert list(tmp_path.iterdir()) == []

    def test_a_reader_that_leaves_early_is_no_error(self):
        words = [sys.executable, "-m", "clbrdf.cli", "evaluate", "--theta-i", "30", "--theta-r", "0:85:0.02"]
        ended = subprocess.run(
            f"{shlex.join(words)} | head -1", shell=True, capture_output=True, text=True, timeout=120
        )
        assert ended.stderr == ""

    def test_a_command_whose_reader_leaves_does_the_rest_and_ends_well(self, tmp_path, scan_file):
        words = [sys.executable, "-m", "clbrdf.cli", "fit", scan_file, "-o", tmp_path / "fit.h5"]
        words += ["--model", "lambert", "--json", tmp_path / "fit.json"]
        ended = subprocess.run(
            ["bash", "-c", f'{shlex.join(map(str, words))} | true; exit "${{PIPESTATUS[0]}}"'],
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert (ended.returncode, ended.stderr) == (0, "")
        assert (tmp_path / "fit.h5").is_file()
        assert (tmp_path / "fit.json").is_file()

    def test_import_is_light(self):
        """What loads slowly loads when it is used: pydantic, SciPy, OpenCL, HDF5, VTK, Matplotlib."""
        heavy = (
            "vtkmodules",
            "pyvista",
            "pyopencl",
            "nlopt",
            "h5py",
            "serial",
            "matplotlib",
            "pydantic",
            "scipy",
        )
        code = f"import sys, clbrdf; print([m for m in {heavy} if m in sys.modules])"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == "[]"

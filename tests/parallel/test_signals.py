"""SIGINT and SIGTERM at random moments of every kind of work: one line, its status, nothing left behind.

`make soak` runs each signal 200 times (CLBRDF_SOAK_RUNS names another number).
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from clbrdf import Fit, InputError, Scan
from clbrdf.scans import sample_scan, sample_scene
from tests.rig.rig_helpers import write_plan, write_rig

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="reads the processes from /proc"),
]

RUNS = int(os.environ.get("CLBRDF_SOAK_RUNS", "200"))
SHARE = 5
"""Commands that share the runs."""

COMMAND = str(Path(sys.executable).with_name("clbrdf"))

FIT = ("fit", "scan.h5", "-o", "out.h5", "--method", "anneal-separable", "--chains", "16", "--levels", "10")
WORK = {
    "fit": FIT,
    "check": ("fit", "scan.h5", "-o", "out.h5", "--check-wavelengths", "4"),
    "simulate": ("simulate", "scene.toml", "-o", "out.h5"),
    "bench": ("bench", "optimizers", "--evaluations", "600", "--seeds", "1", "--problems", "foil-1"),
    "measure": ("measure", "plan.toml", "--rig", "rig.toml", "-o", "out.h5"),
    "batch": ("batch", "scan.h5", "-o", "out", "--workers", "2"),
}
STARTED = 0.1
"""Seconds that Python itself may take to start: before them a signal meets no line of ours."""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    shutil.copy(sample_scan("yellow_tin_foil"), folder / "scan.h5")
    shutil.copy(sample_scene("yellow_tin_foil"), folder / "scene.toml")
    rig = write_rig(folder)
    rig.write_text(rig.read_text().replace("time_factor = 2000", "time_factor = 200"))
    write_plan(folder, step=5.0)
    return folder


def processes_of(session):
    """Return what still runs of a session: state and name."""
    found = []
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/stat") as stream:
                name, _, rest = stream.read().rpartition(")")
        except (FileNotFoundError, ProcessLookupError):
            continue
        state, _, _, its_session = rest.split()[:4]
        if int(its_session) == session and state != "Z":
            found.append(name)
    return found


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("kind", WORK)
def test_a_signal_at_any_moment(kind, number, inputs, tmp_path):
    chance = random.Random(f"{kind} {number}")
    if kind == "batch":
        pytest.importorskip("distributed", reason="Dask is not installed (extra [cluster])")
    with ExitStack() as stack:
        if kind == "measure":
            from clbrdf.rig.emulator.rig import EmulatedRig
            from clbrdf.rig.rigfile import load_rig

            stack.enter_context(EmulatedRig(load_rig(inputs / "rig.toml")))
        longest, wrong, ended = run(kind, tmp_path / "whole", inputs, None, 0.0)[0], [], 0
        for k in range(-(-RUNS // SHARE)):
            moment = STARTED + chance.random() * longest
            folder = tmp_path / str(k)
            _, status, told, left = run(kind, folder, inputs, number, moment, k % 2 == 1)
            ended += status != 0
            complaint = complaint_of(kind, number, status, told, left)
            if complaint:
                wrong.append(f"run {k}, {moment:.3f} s of {longest:.1f}: {complaint}")
            shutil.rmtree(folder, ignore_errors=True)
    assert not wrong, "\n".join(wrong)
    assert ended > 0


def run(kind, folder, inputs, number, moment, group=False):
    """Return (seconds, status, standard error, what is left) of a command that gets a signal at a moment."""
    folder.mkdir()
    work, scratch = folder / "work", folder / "tmp"
    scratch.mkdir()
    shutil.copytree(inputs, work, symlinks=True)  # the ports of an emulated rig are links to terminals
    began = time.monotonic()
    process = subprocess.Popen(
        [COMMAND, *WORK[kind]],
        cwd=work,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "TMPDIR": str(scratch)},
    )
    told = ""
    try:
        try:
            _, told = process.communicate(timeout=None if number is None else moment)
        except subprocess.TimeoutExpired:
            # As a terminal does it, to all processes at once; or to the command alone.
            (os.killpg if group else os.kill)(process.pid, number)
            _, told = process.communicate(timeout=60.0)
        seconds = time.monotonic() - began
        deadline = time.monotonic() + 10.0
        while processes_of(process.pid) and time.monotonic() < deadline:
            time.sleep(0.02)
        left = processes_of(process.pid)
    finally:
        if process.poll() is None:
            process.kill()
    known = {path.name for path in inputs.iterdir()} | whole_of(work)
    left += [path.name for path in work.iterdir() if path.name not in known]
    # Compilers of OpenCL are killed amid their own temporary files only where the batch ends its workers.
    left += [path.name for path in scratch.iterdir() if path.name.startswith("clbrdf")]
    return seconds, process.returncode, told, left


def whole_of(work):
    """Return the names of results that are whole: they were written before the signal came."""
    for kind in (Fit, Scan):
        try:
            kind.open(work / "out.h5")
        except InputError:
            continue
        return {"out.h5"}
    return set()


def complaint_of(kind, number, status, told, left):
    """Return what is wrong with an end, "" where nothing is."""
    # The compiler of OpenCL runs a linker, which in a terminal hears Ctrl-C, too.
    others = ("dashboard: ", "1 error generated.")
    lines = [line for line in told.splitlines() if line.strip() and not line.startswith(others)]
    if "Traceback" in told or "Error" in told or "Exception" in told:
        return told
    if status == 0:  # the work was done before the signal came
        return ""
    if status not in (128 + number, -number):
        return f"status {status}: {told}"
    if kind == "measure":  # what is measured is kept, to go on with
        left = [name for name in left if not name.startswith("out.h5.") and name != "out.h5"]
        lines = [line for line in lines if not line.startswith("stopping after")]
    if kind == "batch":
        left = [name for name in left if name != "out"]
    if left:
        return f"left behind: {left}"
    if len(lines) > 1:
        return told
    return ""

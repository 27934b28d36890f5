"""Kill -9 at random moments: nothing committed is lost, and the joined scan is as if nothing had happened."""

import multiprocessing
import os
import signal
import time

import h5py
import numpy as np
import pytest
from kill_worker import work
from rig_helpers import emulation, write_plan

from clbrdf.errors import InputError
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.calibrate import calibrate
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.row import POINT
from clbrdf.rig.segment import count_rows, read_rows
from clbrdf.rig.store import Lock, run_folder, segments
from clbrdf.scan import Scan

PLAN = {"step": 12.0, "dark_every": 3, "reference_every": 4}


@pytest.fixture(scope="module")
def context():
    """Children are forked from a process that has everything loaded and no threads."""
    server = multiprocessing.get_context("forkserver")
    server.set_forkserver_preload(["kill_worker", "h5py", "serial"])
    return server


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The same plan, not interrupted, and how long it takes."""
    folder = tmp_path_factory.mktemp("whole")
    with emulation(folder) as (rig_path, _, _):
        began = time.monotonic()
        measure(write_plan(folder, **PLAN), rig_path, folder / "scan.h5", budget=POINTS_ONLY)
        seconds = time.monotonic() - began
    return Scan.open(folder / "scan.h5"), read_raw(folder / "scan.h5"), seconds


def counts_by_point(rows):
    return {
        int(point): rows["counts"][k] for k, point in enumerate(rows["point"]) if rows["kind"][k] == POINT
    }


def kill_once(context, plan, rig_path, out, seconds):
    """Start a measurement and kill it after some time; True if the kill came before its end."""
    process = context.Process(target=work, args=(plan, rig_path, out))
    process.start()
    process.join(timeout=seconds)
    if process.is_alive():
        os.kill(process.pid, signal.SIGKILL)
    process.join()
    return process.exitcode == -signal.SIGKILL


def kill_and_resume(context, folder, whole, random, kills):
    """One scan: killed `kills` times, checked each time, then completed."""
    scan, raw, full = whole
    expected = counts_by_point(raw.rows)
    killed = 0
    with emulation(folder) as (rig_path, _, _):
        plan, out = write_plan(folder, **PLAN), folder / "scan.h5"
        before = 0
        for _ in range(kills):
            killed += kill_once(context, plan, rig_path, out, random.uniform(0.0, 1.2 * full))
            found = {}
            for path in segments(run_folder(out)):
                rows = read_rows(path)
                assert len(rows["kind"]) == count_rows(path), "every committed row is readable"
                found |= counts_by_point(rows)
            if not out.exists():
                assert len(found) >= before, "what was committed once stays"
            before = len(found)
            for point, counts in found.items():
                assert np.array_equal(counts, expected[point])
        measure(plan, rig_path, out, resume=True, budget=POINTS_ONLY)
    joined, joined_raw = Scan.open(out), read_raw(out)
    # A child that was let finish used the default budget: calibrate alike.
    joined = calibrate(joined_raw, POINTS_ONLY)
    for name in ("theta_i", "phi_i", "theta_r", "phi_r", "wavelength", "brdf", "sigma", "flags"):
        assert np.array_equal(getattr(joined, name), getattr(scan, name), equal_nan=True), name
    assert {k: v.tobytes() for k, v in counts_by_point(joined_raw.rows).items()} == {
        k: v.tobytes() for k, v in expected.items()
    }
    assert sorted(p.name for p in folder.iterdir()) == ["plan.toml", "ports", "rig.toml", "scan.h5"]
    return killed


def test_killed_and_resumed(context, tmp_path, whole):
    random = np.random.default_rng(11)
    killed = 0
    for k in range(6):
        folder = tmp_path / str(k)
        folder.mkdir()
        killed += kill_and_resume(context, folder, whole, random, kills=1 + k % 3)
    assert killed >= 5


@pytest.mark.soak
def test_200_scans_killed(context, tmp_path, whole):
    random = np.random.default_rng(12)
    killed = scans = 0
    while scans < 200:
        folder = tmp_path / str(scans)
        folder.mkdir()
        killed += kill_and_resume(context, folder, whole, random, kills=1 + scans % 3)
        scans += 1
    print(f"{scans} scans, {killed} kills")
    assert killed >= 200


def test_two_processes_never_write_one_file(tmp_path, context):
    out = tmp_path / "scan.h5"
    with emulation(tmp_path) as (rig_path, _, _):
        with Lock(out), pytest.raises(InputError, match=f"process {os.getpid()} is measuring into it"):
            measure(write_plan(tmp_path, **PLAN), rig_path, out)
        assert not run_folder(out).exists()
        # A lock file whose process was killed does not stand in the way.
        (tmp_path / "scan.h5.lock").write_text("4711\n")
        measure(write_plan(tmp_path, **PLAN), rig_path, out)
    assert not (tmp_path / "scan.h5.lock").exists()


def interrupted(tmp_path, points=5):
    class EnoughError(Exception):
        pass

    def stop(done, total):
        if done == points:
            raise EnoughError

    with emulation(tmp_path) as (rig_path, _, _), pytest.raises(EnoughError):
        measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5", report=stop)
    return tmp_path / "scan.h5"


def test_interrupted_measurement_is_not_overwritten_by_chance(tmp_path):
    out = interrupted(tmp_path)
    with emulation(tmp_path) as (rig_path, _, _):
        plan = tmp_path / "plan.toml"
        with pytest.raises(InputError, match="go on with resume=True, or start again with overwrite=True"):
            measure(plan, rig_path, out)
        measure(plan, rig_path, out, overwrite=True)
        with pytest.raises(InputError, match="exists already"):
            measure(plan, rig_path, out)
        # Resuming what is complete finds nothing to do.
        assert measure(plan, rig_path, out, resume=True).points == 12


@pytest.mark.parametrize(
    ("what", "before", "after"), [("plan", "step = 12", "step = 15"), ("rig", "1.0e-3", "2e-3")]
)
def test_resume_with_another_plan_or_rig(tmp_path, what, before, after):
    out = interrupted(tmp_path)
    path = tmp_path / f"{what}.toml"
    path.write_text(path.read_text().replace(before, after))
    with pytest.raises(
        InputError, match=f"was begun with another {what} file; go on with resume=True and that one"
    ):
        measure(tmp_path / "plan.toml", tmp_path / "rig.toml", out, resume=True)


def test_resume_at_other_ports(tmp_path):
    """USB adapters change their names; that is no other rig."""
    out = interrupted(tmp_path)
    path = tmp_path / "rig.toml"
    with emulation(tmp_path) as (_, _, emulated):
        path.write_text(path.read_text().replace("ports/stages", "ports/other"))
        (tmp_path / "ports" / "other").symlink_to(emulated.instruments["stages"].port.device)
        assert measure(tmp_path / "plan.toml", path, out, resume=True).points == 12


def test_row_damaged_on_disk_is_noticed(tmp_path):
    out = interrupted(tmp_path)
    path = segments(run_folder(out))[0]
    good = read_rows(path)
    data = path.read_bytes()
    place = data.find(good["counts"][1].tobytes())
    assert place > 0
    path.write_bytes(data[: place + 10] + bytes([data[place + 10] ^ 1]) + data[place + 11 :])
    with pytest.raises(InputError, match="row 1 is damaged"):
        read_rows(path)


def test_last_row_torn_by_a_power_cut_is_left_out(tmp_path):
    out = interrupted(tmp_path)
    path = segments(run_folder(out))[0]
    good = read_rows(path)
    data = path.read_bytes()
    place = data.find(good["counts"][-1].tobytes())
    path.write_bytes(data[: place + 10] + bytes([data[place + 10] ^ 1]) + data[place + 11 :])
    assert len(read_rows(path)["kind"]) == len(good["kind"]) - 1


def test_segments_open_in_other_readers(tmp_path):
    """Plain h5py in SWMR mode, units on the fields, the plan inside."""
    out = interrupted(tmp_path)
    with h5py.File(segments(run_folder(out))[0], "r", swmr=True) as file:
        assert file["counts"].attrs["units"] == "counts"
        assert file["counts"].chunks == (1, 1024)
        assert file["axes"].attrs["units"] == "deg"
        assert '"theta_i":[30.0,45.0]' in file.attrs["plan"]

"""The commands as a user runs them: in a process of their own, with mistakes and Ctrl-C."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from rig_helpers import emulation, write_plan, write_rig

from clbrdf.cli import main
from clbrdf.errors import InputError
from clbrdf.rig.demo_scan import measure_demo_scan
from clbrdf.rig.follow import follow, progress_of
from clbrdf.rig.measure import measure
from clbrdf.rig.samples import sample_path
from clbrdf.rig.store import run_folder
from clbrdf.scan import Scan


def clbrdf(*words, cwd, **options):
    environment = {**os.environ, "COLUMNS": "100"}
    command = [sys.executable, "-m", "clbrdf.cli", *map(str, words)]
    return subprocess.Popen(
        command,
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def finished(process):
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


def test_budget_prints_the_papers_numbers(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    assert main(["budget"]) == 0
    text = capsys.readouterr().out
    for number in ("3.34", "1.08", "0.90", "4.84", "6.05"):
        assert number in text
    assert max(map(len, text.splitlines())) <= 100


def test_budget_of_a_scan_as_json(tmp_path, capsys):
    with emulation(tmp_path) as (rig_path, _, _):
        measure(write_plan(tmp_path, step=30.0), rig_path, tmp_path / "scan.h5")
    out = tmp_path / "budget.json"
    assert (
        main(
            [
                "budget",
                str(sample_path("budget.toml")),
                "--scan",
                str(tmp_path / "scan.h5"),
                "--json",
                str(out),
            ]
        )
        == 0
    )
    text = capsys.readouterr().out
    assert "counting" in text
    assert "median (1/sr)" in text
    content = json.loads(out.read_text())
    assert content["total_percent"] == pytest.approx(0.80, abs=0.01)
    assert content["points"]["counting"]["median"] > 0.0


def test_dry_run_moves_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    plan = write_plan(tmp_path, more="repeats = 2")
    plan.write_text(
        plan.read_text().replace("stop = 60", "stop = 89").replace("phi_r = 180", "phi_r = [0, 180]")
    )
    assert main(["measure", str(plan), "--rig", str(write_rig(tmp_path)), "--dry-run"]) == 0
    text = capsys.readouterr().out
    assert "reachable share" in text
    assert "behind the lamp" in text
    assert "estimated time" in text
    assert sorted(p.name for p in tmp_path.iterdir()) == ["plan.toml", "rig.toml"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["measure", "plan.toml", "--rig", "rig.toml"], "no output file; add -o scan.h5"),
        (["measure", "none.toml", "--rig", "rig.toml", "-o", "s.h5"], "none.toml: no such file"),
        (["measure", "plan.toml", "--rig", "none.toml", "-o", "s.h5"], "none.toml: no such file"),
        (["measure", "plan.toml", "--rig", "rig.toml", "-o", "no/s.h5"], "the folder no does not exist"),
        (["measure", "plan.toml", "--rig", "rig.toml", "-o", "s.h5"], "stages: no port"),
        (["measure", "plan.toml", "--rig", "rig.toml", "-o", "s.h5", "--budget", "x"], "x: no such file"),
        (["emulate", "rig.toml", "--fault", "stages"], "write instrument:fault@exchange"),
        (["emulate", "rig.toml", "--fault", "stages:gremlin@3"], "stages has no fault 'gremlin'"),
        (["emulate", "rig.toml", "--fault", "lamp:stall"], "no instrument is called 'lamp'"),
        (["emulate", "rig.toml", "--fault-rate", "2"], "give a share from 0 to 0.5"),
        (["emulate", "none.toml"], "none.toml: no such file"),
        (["calibrate", "none.h5", "-o", "s.h5"], "none.h5: no such file"),
        (["budget", "none.toml"], "none.toml: no such file"),
        (["budget", "--scan", "none.h5"], "none.h5: no such file"),
    ],
)
def test_mistakes_get_one_line(tmp_path, capsys, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    write_plan(tmp_path)
    write_rig(tmp_path)
    assert main(words) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.startswith("clbrdf: ")
    assert captured.err.count("\n") == 1
    left = {p.name for p in tmp_path.iterdir()} - {"ports"}
    assert left == {"plan.toml", "rig.toml"}


def test_calibrate_again(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with emulation(tmp_path) as (rig_path, _, _):
        measure(write_plan(tmp_path, step=30.0), rig_path, "scan.h5")
    assert main(["calibrate", "scan.h5", "-o", "new.h5", "--wavelength", "500:600:50"]) == 0
    assert Scan.open("new.h5").wavelength.tolist() == [500.0, 550.0, 600.0]
    rig_path.write_text(rig_path.read_text().replace("solid_angle = 1.0e-3", "solid_angle = 2.0e-3"))
    assert main(["calibrate", "scan.h5", "-o", "half.h5", "--rig", "rig.toml"]) == 0
    assert Scan.open("half.h5").brdf == pytest.approx(Scan.open("scan.h5").brdf / 2.0)
    capsys.readouterr()
    for wavelength, words in (
        ("a:b", "write start:stop:step"),
        ("100:600:50", "write start:stop:step"),
        ("200:600:50", "scan.h5: wavelengths 200 to 600 nm"),
    ):
        code = main(["calibrate", "scan.h5", "-o", "x.h5", "--wavelength", wavelength])
        assert (code, words in capsys.readouterr().err) == (2, True)
    assert main(["calibrate", "scan.h5", "-o", "new.h5"]) == 2
    assert "exists already" in capsys.readouterr().err


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def rows_so_far(out):
    return progress_of(out).rows if run_folder(out).exists() else 0


def slow(rig_path):
    """A rig on which a point takes about a tenth of a second."""
    text = rig_path.read_text().replace("time_factor = 2000", "time_factor = 30")
    rig_path.write_text(text.replace("homing_time = 2.0", "homing_time = 10.0"))


@pytest.mark.parametrize("times", [1, 2])
def test_ctrl_c(tmp_path, times):
    """Once: the rows are safe and it can be resumed; twice: at once, with stages and shutter safe."""
    slow(write_rig(tmp_path))
    from clbrdf.rig.emulator.rig import EmulatedRig
    from clbrdf.rig.rigfile import load_rig

    rig_path, out = tmp_path / "rig.toml", tmp_path / "scan.h5"
    plan = write_plan(tmp_path, step=5.0)
    with EmulatedRig(load_rig(rig_path)) as emulated:
        process = clbrdf("measure", plan, "--rig", rig_path, "-o", out, cwd=tmp_path)
        wait_for(lambda: rows_so_far(out) > 6)
        for _ in range(times):
            process.send_signal(signal.SIGINT)
            time.sleep(0.002)
        code, _, err = finished(process)
        assert code == 130
        assert "go on with --resume" in err
        assert "Traceback" not in err
        assert not emulated.devices["spectrometer"].shutter
        axes = emulated.devices["stages"].axes.values()
        assert all(axis.move is None for axis in axes)
        assert not out.exists()
        before = rows_so_far(out)
        assert before > 6
        again = clbrdf("measure", plan, "--rig", rig_path, "-o", out, "--resume", cwd=tmp_path)
        code, text, err = finished(again)
        assert (code, err) == (0, "")
        assert "26" in text
    assert Scan.open(out).flag_counts() == {}


def test_follow_a_running_measurement(tmp_path):
    """A reader in another process's file sees rows come, and the end."""
    slow(write_rig(tmp_path))
    from clbrdf.rig.emulator.rig import EmulatedRig
    from clbrdf.rig.rigfile import load_rig

    rig_path, out = tmp_path / "rig.toml", tmp_path / "scan.h5"
    plan = write_plan(tmp_path, step=5.0)
    seen = []
    with EmulatedRig(load_rig(rig_path)):
        process = clbrdf("measure", plan, "--rig", rig_path, "-o", out, cwd=tmp_path)
        wait_for(lambda: rows_so_far(out) > 2)
        watcher = threading.Thread(target=follow, args=(out, seen.append, 0.02))
        watcher.start()
        assert finished(process)[0] == 0
        watcher.join(timeout=30.0)
    points = [progress.points for progress in seen]
    assert points == sorted(points)
    assert len(set(points)) > 5
    assert seen[-1].is_complete
    assert seen[-1].points == seen[-1].total == 26
    assert any(np.isfinite(p.remaining) and p.remaining > 0 for p in seen)
    with pytest.raises(InputError, match="no such file, and no measurement for it"):
        progress_of(tmp_path / "other.h5")


def test_emulate_prints_its_ports_and_ends_cleanly(tmp_path):
    rig_path = write_rig(tmp_path)
    process = clbrdf("emulate", rig_path, "--seed", "3", "--fault", "stages:short_read@60", cwd=tmp_path)
    wait_for(lambda: (tmp_path / "ports" / "reference").exists())
    time.sleep(0.2)
    measure(write_plan(tmp_path, step=30.0), rig_path, tmp_path / "scan.h5")
    process.send_signal(signal.SIGINT)
    code, out, err = finished(process)
    assert (code, err) == (0, "")
    assert "/dev/pts/" in out
    assert "stages" in out.split("faults")[1]
    assert list((tmp_path / "ports").iterdir()) == []


def test_demo_scan(tmp_path):
    began = time.monotonic()
    path = measure_demo_scan(tmp_path / "demo.h5")
    assert time.monotonic() - began < 60.0
    scan = Scan.open(path)
    assert sorted(set(np.round(scan.theta_i, 3))) == [30.0, 45.0, 60.0]
    at_60 = scan.brdf[np.round(scan.theta_i, 3) == 60.0]
    near = np.abs(scan.wavelength - 570.0) <= 10.0
    # Table 1, which the foil has at 570 nm: the peak at 60° is 1996.7 1/sr, and this plan has a point on it.
    assert np.median(at_60[:, near], axis=1).max() == pytest.approx(1996.7, rel=0.02)
    # The foil is yellow: in the mirror direction blue light is the smaller part.
    peak = at_60[at_60[:, near].mean(axis=1).argmax()]
    assert peak[scan.wavelength < 450.0].mean() < 0.5 * peak[scan.wavelength > 600.0].mean()
    with pytest.raises(InputError, match="exists already"):
        measure_demo_scan(tmp_path / "demo.h5")

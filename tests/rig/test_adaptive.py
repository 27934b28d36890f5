"""Adaptive plans on the emulated rig: ends, resumes into the same points, and tells of a wrong model."""

import multiprocessing
import os
import signal

import numpy as np
import pytest
from kill_worker import work
from rig_helpers import emulation

from clbrdf.cli import main
from clbrdf.errors import InputError
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.measure import measure
from clbrdf.rig.planfile import load_plan
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.row import POINT
from clbrdf.rig.segment import count_rows
from clbrdf.rig.store import run_folder, segments

PLAN = """
theta_i = [20, 40, 60]
theta_r = {{ start = 0, stop = 75, step = 1 }}
wavelength = {{ start = 500, stop = 600, step = 50 }}
dark_every = 50
reference_every = 100
longest_time = 0.2
[adaptive]
{adaptive}
"""

SURFACE = """
model = "ggx+lambert"
parameters = { "ggx.alpha" = 0.12, "ggx.F0" = 0.3, "ggx.F90" = 1.0, "lambert.rho" = 0.2 }
"""

GGX = """
model = "ggx+lambert"
fix = { "ggx.F90" = 1.0 }
start = 12
batch = 6
"""

NOISE = "shot_noise = true\nread_noise = 3.0"


def write(folder, adaptive):
    path = folder / "plan.toml"
    path.write_text(PLAN.format(adaptive=adaptive))
    return path


def points_of(path):
    rows = read_raw(path).rows
    mine = rows["kind"] == POINT
    return rows["point"][mine], rows["nominal"][mine]


def test_ends_at_its_target(tmp_path):
    """The last batch brings σ below the target, and the truth lies within five of it."""
    plan = write(tmp_path, GGX + 'parameters = ["ggx.alpha"]\nsigma = 0.001')
    with emulation(tmp_path, emulator=SURFACE, effects=NOISE) as (rig_path, _, _):
        outcome = measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    assert outcome.end.startswith("the target is reached")
    assert not outcome.doubt
    assert outcome.points < 120
    log = read_raw(tmp_path / "scan.h5").log
    assert "planner: batch: 12 points" in log
    assert "validation points off by" in log


def test_a_wrong_model_is_told(tmp_path):
    """A surface with another lobe than the plan's: its validation points say so, and the exit status too."""
    plan = write(tmp_path, 'model = "lambert"\nparameters = ["rho"]\nsigma = 0.003')
    with emulation(tmp_path, emulator=SURFACE, effects=NOISE) as (rig_path, _, _):
        outcome = measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    assert "lambert does not describe this surface" in outcome.doubt


def test_a_target_out_of_reach(tmp_path, capsys):
    plan = write(tmp_path, GGX + 'parameters = ["ggx.alpha"]\nsigma = 1e-7\npoints = 30')
    with emulation(tmp_path, emulator=SURFACE, effects=NOISE) as (rig_path, _, _):
        outcome = measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    assert outcome.points == 30
    assert "the target is not reached" in outcome.doubt
    assert "planner: target out of reach: all " in read_raw(tmp_path / "scan.h5").log


def test_time_is_kept(tmp_path):
    plan = write(tmp_path, GGX + "time = 60")
    with emulation(tmp_path, emulator=SURFACE) as (rig_path, _, _):
        outcome = measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    assert 5 < outcome.points < 200
    seconds = float(outcome.end.split(" points, ")[1].split(" s ")[0])
    assert 40.0 < seconds <= 60.0


def test_killed_and_resumed_to_the_same_points(tmp_path):
    """kill -9 at random moments; with no noise the rows, and so the plan, are those of an undisturbed run."""
    adaptive = GGX + "hemisphere = 1e-5\npoints = 36"
    plans = {}
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["kill_worker", "h5py", "serial"])
    random, killed = np.random.default_rng(5), 0
    for name in ("whole", "killed"):
        folder = tmp_path / name
        folder.mkdir()
        plan, out = write(folder, adaptive), folder / "scan.h5"
        with emulation(folder, emulator=SURFACE) as (rig_path, _, _):
            if name == "killed":
                for _ in range(4):
                    process = context.Process(target=work, args=(plan, rig_path, out))
                    process.start()
                    wanted = sum(map(count_rows, segments(run_folder(out)))) + int(random.integers(3, 9))
                    while process.is_alive() and not _has(run_folder(out), wanted):
                        process.join(0.01)
                    if process.is_alive():
                        os.kill(process.pid, signal.SIGKILL)
                        killed += 1
                    process.join()
            measure(plan, rig_path, out, resume=True)
        plans[name] = points_of(out)
    assert killed >= 3
    for one, other in zip(plans["whole"], plans["killed"], strict=True):
        assert np.array_equal(one, other)


def _has(folder, rows):
    try:
        return sum(map(count_rows, segments(folder))) >= rows
    except (OSError, InputError):
        return False


@pytest.mark.parametrize(
    ("adaptive", "words"),
    [
        ('model = "gx"\ntime = 1', "adaptive: "),
        ('model = "lambert"', "give a target"),
        ('model = "lambert"\nparameters = ["alpha"]\nsigma = 0.1', "has no parameter 'alpha'"),
        ('model = "lambert"\nparameters = ["rho"]', "parameters and sigma belong together"),
        ('model = "lambert"\nfix = { rho = 0.2 }\ntime = 1', "nothing is left to find out"),
        ('model = "lambert"\ntime = 1\nbatc = 3', "did you mean batch?"),
    ],
)
def test_mistakes_in_the_section(tmp_path, adaptive, words):
    with pytest.raises(InputError, match=r"plan\.toml") as error:
        load_plan(write(tmp_path, adaptive))
    assert words in str(error.value)


def test_too_few_incident_angles(tmp_path, capsys):
    path = tmp_path / "plan.toml"
    text = PLAN.format(adaptive='model = "lambert"\ntime = 9').replace("[20, 40, 60]", "[20, 40]")
    path.write_text(text)
    with emulation(tmp_path) as (rig_path, _, _):
        assert main(["measure", str(path), "--rig", str(rig_path), "-o", str(tmp_path / "s.h5")]) == 2
    assert "needs at least 3 incident angles and theta_i has 2" in capsys.readouterr().err

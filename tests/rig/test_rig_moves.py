"""Collision zones, park, pause; stages by hand on a terminal; planners; watching live; bluesky."""

import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_helpers import connected, emulation, write_plan, write_rig

from clbrdf.cli import main
from clbrdf.cli.live_view import picture, spark
from clbrdf.errors import InputError
from clbrdf.rig.acquire import Acquisition
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.errors import InstrumentError
from clbrdf.rig.measure import measure
from clbrdf.rig.planfile import load_plan
from clbrdf.rig.planner import FixedRoute, Target
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.route import plan_route
from clbrdf.rig.row import CHECK, POINT, SKIPPED
from clbrdf.rig.zones import find_legs, is_free, is_inside
from clbrdf.scan import Scan

ZONE = ((-20.0, 20.0), (-360.0, 360.0), (30.0, 90.0))


def with_stages(path, line):
    """The text of a rig file with a line more in its stages."""
    return path.read_text().replace("homing_time = 4.0", f"homing_time = 4.0\n{line}")


angle = st.integers(-90, 90).map(float)
pose = st.tuples(angle, angle, angle)
zone = st.tuples(*[st.tuples(angle, angle).map(sorted).map(tuple)] * 3)


@given(pose, pose, st.lists(zone, max_size=3), st.tuples(*[st.floats(0, 1)] * 3))
def test_legs_never_enter_a_zone(here, there, zones, speeds):
    """Whatever the axes' speeds, no pose on the way lies in a zone."""
    legs = find_legs(here, there, zones, [(0.0, 0.0, 0.0)])
    if legs is None:
        assert not is_free(here, there, zones)
        return
    assert legs[-1] == there
    for a, b in zip([here, *legs], legs, strict=False):
        times = np.linspace(0.0, 1.0, 101)[:, None]
        share = np.clip(times / (1e-3 + np.array(speeds)), 0.0, 1.0)
        way = np.array(a) + (np.array(b) - np.array(a)) * share
        assert not is_inside(way, zones).any()


def test_moves_go_round_a_zone(tmp_path):
    path = write_rig(tmp_path)
    text = with_stages(path, "zones = [{ lamp = [20, 60], pitch = [30, 90] }]")
    path.write_text(text)
    rig = load_rig(path)
    with EmulatedRig(rig) as emulated, connected(rig, emulated) as (instruments, _):
        instruments.stages.move((10.0, 0.0, 50.0))
        stages, seen = emulated.devices["stages"], []
        answer = stages.answer

        def watch(request):
            seen.append(stages.true_angles())
            return answer(request)

        stages.answer = watch
        assert instruments.stages.move((80.0, 5.0, 50.0)) == (80.0, 5.0, 50.0)
        assert not is_inside(np.array(seen), rig.stages.boxes).any()
        assert max(a[0] for a in seen) > 60
        with pytest.raises(
            InstrumentError, match=r"no way from .* around the collision zones; set stages.park"
        ):
            instruments.stages.move((40.0, 0.0, 50.0))


def test_points_in_a_zone_are_left_out(tmp_path, capsys):
    path = write_rig(tmp_path)
    path.write_text(with_stages(path, "zones = [{ turn = [20, 95] }, { turn = [-95, -20] }]"))
    route = plan_route(load_plan(write_plan(tmp_path)), load_rig(path))
    assert route.unreachable["in a collision zone"] > 0
    assert not is_inside(route.axes, load_rig(path).stages.boxes).any()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("zones = [{}]", "names no axis"),
        ("zones = [{ lamp = [3, 2] }]", "give the lower angle first"),
        ("park = [0, 100, 0]", "park puts turn at 100°"),
        ('homing_order = ["lamp", "lamp", "turn"]', "give each of lamp, turn, pitch once"),
        ('homing_order = ["lamp", "tilt", "turn"]', "homing_order"),
    ],
)
def test_bad_settings(tmp_path, line, words):
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("homing_time = 4.0", f"homing_time = 4.0\n{line}"))
    with pytest.raises(InputError, match=words):
        load_rig(path)


def test_parked_at_the_end(tmp_path):
    with emulation(tmp_path) as (rig_path, _, emulated):
        rig_path.write_text(with_stages(rig_path, "park = [90, 10, -5]"))
        measure(write_plan(tmp_path, step=30.0), rig_path, tmp_path / "scan.h5")
        assert emulated.devices["stages"].true_angles() == pytest.approx((90.0, 10.0, -5.0))
        assert not emulated.devices["spectrometer"].shutter


def in_terminal(words, cwd, answer, seconds=60.0):
    """Run a command with a terminal of its own; `answer(text so far)` gives what a person types, or None."""
    pid, handle = pty.fork()
    if pid == 0:
        os.chdir(cwd)
        os.execve(
            sys.executable, [sys.executable, "-m", "clbrdf.cli", *words], {**os.environ, "COLUMNS": "100"}
        )
    text, end = "", time.monotonic() + seconds
    try:
        while time.monotonic() < end:
            if select.select([handle], [], [], 0.05)[0]:
                try:
                    text += os.read(handle, 4096).decode("utf-8", "replace")
                except OSError:
                    break
            reply = answer(text)
            if reply is not None:
                os.write(handle, reply.encode())
    finally:
        os.close(handle)
        _, status = os.waitpid(pid, 0)
    return os.waitstatus_to_exitcode(status), text


def test_a_pitch_by_hand_on_a_terminal(tmp_path):
    """A whole scan: the person is asked for the zero and for every other angle, and mistypes once."""
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("pitch = { address = 3,", 'pitch = { driver = "manual",'))
    plan = write_plan(tmp_path, step=30.0)
    plan.write_text(plan.read_text().replace("phi_r = 180", "phi_r = [150, 180]\nregion = 'hemispherical'"))
    asked = []
    with EmulatedRig(load_rig(path)) as emulated:
        stages = emulated.devices["stages"]
        true = stages.true_angles
        hand = {"at": 0.0}
        emulated.world.axes = lambda: (*true()[:2], hand["at"])

        def answer(text):
            questions = re.findall(r"(set pitch to .*?|'hm' is no angle.*?): ", text)
            if len(questions) <= len(asked):
                return None
            question = questions[len(asked)]
            asked.append(question)
            found = re.search(r"to (-?[\d.]+)°", question)
            if found:
                hand["at"] = float(found[1])
            return "hm\n" if len(asked) == 2 else "\n"

        code, text = in_terminal(
            ["measure", str(plan), "--rig", str(path), "-o", "scan.h5"], tmp_path, answer
        )
    assert code == 0, text[-600:]
    assert len(asked) > 5
    assert any("no angle" in question for question in asked)
    scan = Scan.open(tmp_path / "scan.h5")
    from test_rig_measure import model_values

    assert scan.brdf == pytest.approx(np.broadcast_to(model_values(scan), scan.brdf.shape), rel=5e-3)


def test_by_hand_without_a_terminal(tmp_path):
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("pitch = { address = 3,", 'pitch = { driver = "manual",'))
    plan = write_plan(tmp_path)
    words = [sys.executable, "-m", "clbrdf.cli", "measure", str(plan), "--rig", str(path), "-o", "scan.h5"]
    with EmulatedRig(load_rig(path)):
        done = subprocess.run(
            words,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
            start_new_session=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    assert done.returncode == 2
    assert "there is no terminal: start the measurement in one" in done.stderr
    assert done.stderr.count("\n") == 1


def test_pause_and_go_on(tmp_path):
    """Ctrl-Z after a point: the shutter is closed, the process stops; continued, it checks a point first."""
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("time_factor = 2000", "time_factor = 60"))
    # So many points that they do not come to an end before the pause is asked for.
    plan, out = write_plan(tmp_path, step=2.5), tmp_path / "scan.h5"
    words = [sys.executable, "-m", "clbrdf.cli", "measure", str(plan), "--rig", str(path), "-o", str(out)]
    from clbrdf.rig.follow import progress_of
    from clbrdf.rig.store import run_folder

    with EmulatedRig(load_rig(path)) as emulated:
        process = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        end = time.monotonic() + 60.0
        while not (run_folder(out).exists() and progress_of(out).points > 3) and time.monotonic() < end:
            time.sleep(0.02)
        process.send_signal(signal.SIGTSTP)
        assert os.waitpid(process.pid, os.WUNTRACED)[1] & 0xFF == 0x7F, "stopped"
        assert not emulated.devices["spectrometer"].shutter
        before = progress_of(out).points
        time.sleep(0.3)
        assert progress_of(out).points == before
        process.send_signal(signal.SIGCONT)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert "pausing after this point" in err
    assert np.count_nonzero(read_raw(out).rows["kind"] == CHECK) == 1


class Chosen:
    """A planner that makes up each point from the last one's counts: brighter ones are looked at twice."""

    total = None

    def __init__(self, route):
        self.route = route
        self.told = []

    def ask(self):
        number = len(self.told)
        if number == 6:
            return None
        k = 0 if number and self.told[-1].counts.max() > 2000 else number
        d = self.route.directions
        return Target(number, np.array([d.theta_i[k], 0.0, d.theta_r[k], d.phi[k]]), self.route.axes[k])

    def tell(self, row):
        self.told.append(row)


def test_a_planner_of_ones_own(tmp_path, monkeypatch):
    """Ask and tell: the points follow from the rows; resumed, the same points follow again."""
    from clbrdf.rig import measure as module

    monkeypatch.setattr(module, "FixedRoute", Chosen)
    plan = write_plan(tmp_path)

    class EnoughError(Exception):
        pass

    def stop(done, total):
        if done == 3:
            raise EnoughError

    nominal = {}
    for name, report in (("whole", None), ("broken", stop)):
        folder = tmp_path / name
        folder.mkdir()
        with emulation(folder) as (rig_path, _, _):
            if report is not None:
                with pytest.raises(EnoughError):
                    measure(plan, rig_path, folder / "scan.h5", budget=POINTS_ONLY, report=report)
            assert measure(plan, rig_path, folder / "scan.h5", budget=POINTS_ONLY, resume=True).points == 6
        raw = read_raw(folder / "scan.h5")
        nominal[name] = raw.rows["nominal"][raw.rows["kind"] == POINT]
    assert np.array_equal(nominal["whole"], nominal["broken"])
    assert len(nominal["whole"]) == 6


def test_fixed_route_asks_in_order(tmp_path):
    route = plan_route(load_plan(write_plan(tmp_path)), load_rig(write_rig(tmp_path)))
    planner = FixedRoute(route)
    assert planner.total == len(route)
    first = planner.ask()
    assert first.number == planner.ask().number == 0
    row = type("Row", (), {"point": 0})()
    planner.tell(row)
    assert planner.ask().number == 1
    assert planner.ask().nominal[2] == route.directions.theta_r[1]
    for k in range(1, len(route)):
        row.point = k
        planner.tell(row)
    assert planner.ask() is None


def test_live_shows_the_values_of_the_scan(tmp_path):
    """What is shown for each point is what the scan holds in the end."""
    shown = []
    with emulation(tmp_path, effects="shot_noise = true\nread_noise = 3.0") as (rig_path, _, _):
        measure(write_plan(tmp_path), rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY, live=shown.append)
    scan = Scan.open(tmp_path / "scan.h5")
    assert [s.done for s in shown] == list(range(1, 15))
    assert np.array_equal([s.brdf for s in shown], scan.brdf)
    assert np.array_equal([s.wavelength for s in shown], np.tile(scan.wavelength, (14, 1)))
    assert all(np.isfinite(s.remaining) for s in shown)
    assert shown[-1].remaining == 0.0
    text = picture(shown[4])
    assert "5/14" in text
    assert "1/sr at 550 nm" in text
    assert max(map(len, text.splitlines())) <= 100


def test_live_on_the_command_line(tmp_path, capsys):
    with emulation(tmp_path) as (rig_path, _, _):
        words = [
            "measure",
            str(write_plan(tmp_path, step=20.0)),
            "--rig",
            str(rig_path),
            "-o",
            str(tmp_path / "s.h5"),
        ]
        assert main([*words, "--live"]) == 0
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 8
    assert lines[0].startswith("1/8  θi")


def test_spark():
    assert spark(np.array([0.0, 0.5, 1.0])) == " ▄█"
    assert spark(np.array([np.nan, 1.0])) == " █"
    assert spark(np.zeros(3)) == "   "
    assert len(spark(np.arange(500.0))) == 60


def test_skipped_points_are_shown(tmp_path):
    shown = []
    with emulation(tmp_path, patience=0.3) as (rig_path, _, emulated):
        plan = write_plan(tmp_path, step=20.0, time=0.05)

        def inject(done, total):
            if done == 3 and not emulated.injector.injected:
                emulated.injector.inject("stages", "limit_switch", at=0)

        measure(plan, rig_path, tmp_path / "scan.h5", live=shown.append, report=inject)
    assert [bool(s.row.flags & SKIPPED) for s in shown].count(True) == 1
    assert "skipped" in picture(next(s for s in shown if s.row.flags & SKIPPED))


def test_bluesky_drives_the_rig(tmp_path):
    """A RunEngine scans the turn over the specular peak."""
    bluesky = pytest.importorskip("bluesky", reason="the extra bluesky is not installed")
    from bluesky import RunEngine
    from bluesky.plans import scan as scan_plan
    from bluesky.protocols import Movable, Readable, Stoppable, Triggerable

    from clbrdf.rig.bluesky import connect_devices

    documents = []
    with emulation(tmp_path, emulator='model = "ggx"\nparameters = {alpha = 0.05}') as (_, rig, emulated):
        with connect_devices(rig) as devices:
            assert isinstance(devices.turn, Movable)
            assert isinstance(devices.turn, Readable)
            assert isinstance(devices.turn, Stoppable)
            assert isinstance(devices.spectrometer, Triggerable)
            engine = RunEngine({}, call_returns_result=False)
            devices.lamp.set(60.0).exception(60.0)
            engine(
                scan_plan([devices.spectrometer], devices.turn, 26.0, 34.0, 9),
                lambda name, document: documents.append((name, document)),
            )
            status = devices.spectrometer.trigger()
            assert status.exception(60.0) is None
            assert status.success
            with pytest.raises(ValueError, match=r"turn: 100° is outside \[-95, 95\]°"):
                devices.turn.set(100.0)
        assert not emulated.devices["spectrometer"].shutter
    events = [document["data"] for name, document in documents if name == "event"]
    assert [event["turn"] for event in events] == pytest.approx(np.arange(26.0, 35.0), abs=2e-3)
    light = [event["spectrometer_sum"] for event in events]
    assert int(np.argmax(light)) == 4, "the mirror position of a lamp at 60° is 30°"
    assert len(events[0]["spectrometer_spectrum"]) == 1024
    assert bluesky


def test_acquisition_takes_a_planner():
    """The seam: nothing in an acquisition knows of a route."""
    import inspect

    assert list(inspect.signature(Acquisition.__init__).parameters)[3] == "planner"
    assert "route" not in inspect.getsource(Acquisition)

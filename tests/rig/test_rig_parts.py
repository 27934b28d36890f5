"""Smaller parts: integration ladder, drivers by name, fault injection, the emulated port, motion."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_helpers import connected, emulation, write_rig

from clbrdf.errors import InputError
from clbrdf.rig import drivers
from clbrdf.rig.emulator.faults import FAULTS, Injector
from clbrdf.rig.emulator.port import PseudoTerminal
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.emulator.stages import CONFIGURATION, Move
from clbrdf.rig.errors import BadReplyError, NoReplyError, UnpluggedError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.exposure import Exposer, ladder
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import SpectrometerSettings, load_rig
from clbrdf.rig.transport import SerialLine


class Light:
    """A spectrometer in memory: counts proportional to time, and a hundredth of it in the last pixels."""

    full_scale = 16383
    pixels = 6
    shortest, longest = 10e-6, 85.0

    def __init__(self, rate):
        self.rate = rate
        self.asked = []

    def set_shutter(self, is_open):
        pass

    def set_integration_time(self, seconds):
        self.seconds = seconds

    def measure_spectrum(self):
        self.asked.append(self.seconds)
        light = self.rate * self.seconds * np.array([0.0, 1.0, 1.0, 0.01, 0.01, 0.0])
        return np.minimum(1500 + light, self.full_scale).astype(np.uint32)


SETTINGS = SpectrometerSettings(shutter_time=0.0)
LIMIT = int(0.95 * 16383)


def exposer(light, times, scans=1):
    return Exposer(light, SETTINGS, times, scans, slice(0, 6), EventLog(), lambda: None)


@given(st.floats(1.0, 1e9), st.integers(0, 8))
def test_exposure_is_the_longest_that_fits(rate, first):
    times = ladder(Plan(theta_i=[30], theta_r=[30], longest_time=2.0), 10e-6, 85.0)
    light = Light(rate)
    exposure = exposer(light, times).expose(times[first], True)
    peak = int(exposure.counts.max())
    if exposure.saturated:
        assert exposure.seconds == times[0]
        assert 1500 + rate * times[0] >= LIMIT
    else:
        assert peak < LIMIT
        place = times.index(exposure.seconds)
        if place + 1 < len(times) and light.asked[0] <= exposure.seconds:
            assert 1500 + (peak - 1500 + 2.0) * 4.0 >= 0.8 * LIMIT, "a longer time would have fitted"


def test_ladders():
    times = ladder(Plan(theta_i=[30], theta_r=[30], shortest_time=1e-3, longest_time=0.1), 10e-6, 85.0)
    assert times == (1e-3, 4e-3, 16e-3, 64e-3)
    fixed = ladder(Plan(theta_i=[30], theta_r=[30], integration_time=0.2), 10e-6, 85.0)
    assert fixed[-1] == 0.2
    assert fixed[-2] == 0.05
    assert fixed[0] >= 10e-6
    assert ladder(Plan(theta_i=[30], theta_r=[30]), 0.5, 0.5) == (0.5,), "a meter knows one time"
    assert ladder(Plan(theta_i=[30], theta_r=[30], longest_time=80.0), 1e-3, 10.0)[-1] <= 10.0


def test_a_fixed_time_never_grows():
    times = ladder(Plan(theta_i=[30], theta_r=[30], integration_time=0.2), 10e-6, 85.0)
    light = Light(10.0)
    assert exposer(light, times).expose(0.2, False).seconds == 0.2
    assert set(light.asked) == {0.2}


@pytest.mark.parametrize(("flashes", "saturated"), [(2, False), (3, True)])
def test_a_flash_at_the_shortest_time_passes(flashes, saturated):
    light = Light(10.0)
    one = exposer(light, (0.01,))
    one.take(0.01)  # the shutter has come to rest
    usual, light.asked = light.measure_spectrum, []

    def measure_spectrum():
        light.rate = 1e9 if len(light.asked) < flashes else 10.0
        return usual()

    light.measure_spectrum = measure_spectrum
    assert one.expose(0.01, False).saturated == saturated
    assert [event.kind for event in one.log.events] == ["saturation"] * 2


def test_longer_rungs_and_a_scan_that_saturates_in_a_sum():
    times = (0.01, 0.04, 0.16)
    light = Light(1e6)
    one = exposer(light, times, scans=3)
    base = one.expose(0.01, True)
    assert base.counts.tolist() == [3 * 1500, 3 * 11500, 3 * 11500, 3 * 1600, 3 * 1600, 3 * 1500]
    rungs = one.longer(base, 5)
    assert [rung.seconds for rung in rungs] == [0.04, 0.16]
    assert rungs[1].counts.tolist() == [4500, 3 * 16383, 3 * 16383, 3 * 3100, 3 * 3100, 4500]
    assert rungs[1].saturated


def test_another_makers_part_is_one_new_file(tmp_path, monkeypatch):
    (tmp_path / "acme9.py").write_text(
        'ROLES = ("reference",)\n'
        "from clbrdf.storage.tomlfile import TomlTable\n"
        "class Connection(TomlTable):\n    channel: int = 1\n"
        "def connect(settings, context):\n    return settings.channel\n"
    )
    monkeypatch.setattr(drivers, "__path__", [*drivers.__path__, str(tmp_path)])
    assert {"acme9", "newport1830c"} <= set(drivers.driver_names("reference"))
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("[reference]", '[reference]\ndriver = "acme9"\nchannel = 3'))
    with pytest.raises(InputError, match=r"unknown key reference\.port; known here: .*channel"):
        load_rig(path)
    text = path.read_text()
    section = text.index("[reference]")
    keys = ("port", "baud", "patience", "reply_time")
    rest = [line for line in text[section:].splitlines() if not line.startswith(keys)]
    path.write_text(text[:section] + "\n".join(rest))
    rig = load_rig(path)
    assert drivers.get_driver("reference", "acme9").connect(rig.reference, None) == 3


def test_random_faults_come_from_the_seed():
    def drawn(seed):
        injector = Injector(rate=0.2, seed=seed)
        out = []
        for k in range(200):
            for fault in injector.draw("stages", k, "1TP"):
                injector.happened("stages", k, fault, "1TP")
                out.append((k, fault))
        return out

    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)
    assert 20 <= len(drawn(1)) <= 60
    assert {fault for _, fault in drawn(1)} <= set(FAULTS["stages"])


def test_planned_faults_wait_for_their_moment():
    injector = Injector()
    injector.inject("stages", "short_read", at=10, on="TP")
    assert injector.draw("stages", 9, "1TP") == []
    assert injector.draw("stages", 10, "1TS") == []
    assert injector.draw("reference", 11, "TP") == []
    assert injector.draw("stages", 12, "1TP") == ["short_read"]
    injector.happened("stages", 12, "short_read", "1TP")
    assert injector.draw("stages", 13, "1TP") == []
    with pytest.raises(InputError, match="reference has no fault 'stall'"):
        injector.inject("reference", "stall")


def test_a_line_keeps_its_speed(tmp_path):
    port = PseudoTerminal(tmp_path / "port", 9600)
    port.plug()
    began = time.monotonic()
    port.write(bytes(96))
    assert time.monotonic() - began >= 0.1, "96 bytes are 0.1 s at 9600 baud"
    port.unplug()
    assert not (tmp_path / "port").is_symlink()


def test_port_name_outlives_the_plug(tmp_path):
    port = PseudoTerminal(tmp_path / "port", None)
    port.plug()
    line = SerialLine("device", str(tmp_path / "port"), 115200, 0.1, 0.02, EventLog())
    line.open()
    port.write(b"hello\n")
    assert line.read_until(b"\n", time.monotonic() + 5.0) == b"hello"
    port.unplug()

    def send_on():
        while True:
            line.send(b"x")
            time.sleep(0.001)

    with pytest.raises(UnpluggedError, match="plug it in again"):
        send_on()
    assert not line.is_open
    port.plug()
    line.open()
    port.write(b"again\n")
    assert line.read_until(b"\n", time.monotonic() + 5.0) == b"again"
    line.close()
    port.unplug()


def test_read_until_keeps_what_follows_and_bounds_a_line(tmp_path):
    port = PseudoTerminal(tmp_path / "port", None)
    port.plug()
    line = SerialLine("device", str(tmp_path / "port"), 115200, 0.1, 0.02, EventLog())
    line.open()
    port.write(b"one\ntwo\nthr")
    assert line.read_until(b"\n", time.monotonic() + 5.0) == b"one"
    assert line.read_until(b"\n", time.monotonic() + 5.0) == b"two"
    with pytest.raises(NoReplyError, match="short reply b'thr'"):
        line.read_until(b"\n", time.monotonic() + 0.05)
    port.write(bytes(range(1, 10)) * 60)
    with pytest.raises(BadReplyError, match="without an end of line"):
        line.read_until(b"\xff", time.monotonic() + 5.0)
    assert line.drain()
    line.close()
    port.unplug()


def test_deadline_counts_bits(tmp_path):
    line = SerialLine("device", "x", 9600, 0.3, 0.02, EventLog())
    now = time.monotonic()
    assert line.deadline(2112, 1.0) - now == pytest.approx(2.2 + 1.0 + 0.3 + 0.02, abs=0.05)


@given(st.floats(-180, 180), st.floats(-180, 180), st.floats(1, 40), st.floats(1, 200))
def test_emulated_motion_is_a_trapezoid(start, target, velocity, acceleration):
    move = Move(start, target, 0.0, velocity, acceleration)
    times = np.linspace(0.0, move.duration, 200)
    places = np.array([move.position(t) for t in times])
    assert places[0] == pytest.approx(start, abs=1e-9)
    assert places[-1] == pytest.approx(target, abs=1e-9)
    step = times[1]
    if step > 1e-6:
        speed = np.diff(places) / step
        assert np.abs(speed).max() <= velocity * (1 + 1e-6)
        assert np.abs(np.diff(speed)).max() / step <= acceleration * (1 + 1e-4) + 1e-3 / step


def test_moves_are_read_back(tmp_path):
    with emulation(tmp_path) as (_, rig, emulated), connected(rig, emulated) as (instruments, log):
        assert instruments.stages.move((20.0, -10.0, 5.0)) == (20.0, -10.0, 5.0)
        # The lamp's zero lies at 10°, the turn's sign is −1.
        axes = emulated.devices["stages"].axes
        assert [axes[k].place for k in (1, 2, 3)] == [30.0, 10.0, 5.0]
        assert emulated.devices["stages"].true_angles() == pytest.approx((20.0, -10.0, 5.0))
        assert [axes[k].defaults["SR"] for k in (1, 2, 3)] == [191.0, 95.0, 90.0]
        assert log.events == []


def test_a_move_that_went_elsewhere_is_sent_again(tmp_path):
    """A digit of the command was lost: the stage reports ready, at the wrong place."""
    with emulation(tmp_path) as (_, rig, emulated), connected(rig, emulated) as (instruments, log):
        stages = emulated.devices["stages"]
        answer, done = stages.answer, []

        def damaged(request):
            if request.startswith(b"1PA") and not done:
                done.append(request)
                request = request.replace(b"30.5", b"30")
            return answer(request)

        stages.answer = damaged
        assert instruments.stages.move((20.5, 0.0, 0.0))[0] == 20.5
        assert done
        assert [event.kind for event in log.events] == ["wrong position"]


def test_homing_from_every_state(tmp_path):
    """Configuration (silent while it is left), disabled, moving, not referenced: all end at home."""
    path = write_rig(tmp_path)
    # Three seconds of silence are 0.1 s here: longer than nothing, shorter than the deadline.
    path.write_text(path.read_text().replace("time_factor = 2000", "time_factor = 30"))
    rig = load_rig(path)
    with EmulatedRig(rig) as emulated:
        stages = emulated.devices["stages"]
        stages.axes[1].state = CONFIGURATION
        with connected(rig, emulated) as (instruments, _):
            assert instruments.stages.positions() == (-10.0, 0.0, 0.0)
            stages.answer(b"2MM0\r\n")
            stages.answer(b"3PA40\r\n")
            assert instruments.recover(must_home=False), "not all were ready"
            assert instruments.stages.move((1.0, 2.0, 3.0)) == (1.0, 2.0, 3.0)


def test_recovery_that_fails_half_way_still_homes(tmp_path):
    """The stages' line is lost, and the reference detector with it: the homing stays due."""
    with emulation(tmp_path) as (_, rig, emulated), connected(rig, emulated) as (instruments, _):
        instruments.stages.groups[0].line.close()
        assert instruments.calls_for_homing(UnpluggedError("stages: gone"))
        assert instruments.recover(must_home=True)
        assert not instruments.recover(must_home=False)


def test_log_lines_have_a_zone(tmp_path):
    log = EventLog(tmp_path / "log.txt")
    log.add("stages", "stall", "lamp\nstopped")
    line = (tmp_path / "log.txt").read_text()
    assert line == f"{log.events[0]}\n"
    assert line.endswith("stages: stall: lamp stopped\n")
    assert line[23] in "+-"


def test_line_without_flow_control(tmp_path):
    """0x11 and 0x13 are data: they pass, in both directions."""
    port = PseudoTerminal(tmp_path / "port", None)
    port.plug()
    line = SerialLine("device", str(tmp_path / "port"), 115200, 0.1, 0.02, EventLog())
    line.open()
    line.send(b"a\x13b\x11c\x00\xff")
    data = b""
    while len(data) < 7:
        data += port.read(1.0)
    assert data == b"a\x13b\x11c\x00\xff"
    port.write(data + b"\n")
    assert line.read_until(b"\n", time.monotonic() + 5.0) == data
    line.close()
    port.unplug()


def test_import_of_the_package_is_light():
    import subprocess
    import sys

    heavy = ("serial", "h5py", "pydantic", "clbrdf.rig")
    code = f"import sys, clbrdf; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_two_emulators_do_not_share_a_port(tmp_path):
    first, second = PseudoTerminal(tmp_path / "port", None), PseudoTerminal(tmp_path / "port", None)
    first.plug()
    with pytest.raises(InputError, match="an emulator serves this port"):
        second.plug()
    first.unplug()
    (tmp_path / "port").symlink_to("/dev/pts/no-such-terminal")  # left over from one that was killed
    second.plug()
    second.unplug()

"""Every fault that the emulator injects ends as EXPECTED says: mended, flagged, or in words."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from rig_helpers import connected, emulation, write_plan, write_rig

from clbrdf.errors import InputError
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.faults import FAULTS
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.emulator.stages import RESET
from clbrdf.rig.errors import InstrumentError, StoppedError, StorageError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.instruments import Instruments, make_instruments
from clbrdf.rig.measure import measure, never
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import CHECK
from clbrdf.rig.segment import read_rows
from clbrdf.rig.store import run_folder, segments
from clbrdf.scan import Scan

PLAN = {"step": 20.0, "time": 0.05, "dark_every": 3, "reference_every": 100}

QUICK = {"patience": 0.25}
"""Where replies get lost: deadlines that pass soon."""

EXPECTED = {
    "short_read": {"no reply", "bad reply"},
    "garbage": {"bad reply", "garbage", "stale bytes", "no reply"},
    "nul_bytes": {"bad reply", "garbage", "stale bytes"},
    "lost_byte": {"bad reply", "no reply", "reading disagrees", "garbage", "command error", "recovery"},
    "no_reply": {"no reply"},
    "stale_reply": {"no reply"},
    "duplicate_reply": {"stale bytes", "stale reply", "bad reply"},
    "lost_command_byte": {
        "no reply",
        "bad reply",
        "command error",
        "wrong position",
        "setting disagrees",
        "reading disagrees",
    },
    "unplug": {"replugged"},
    "limit_switch": {"limit switch"},
    "stall": {"stall"},
    "homing_lost": {"homing lost", "command error", "wrong position"},
    "saturation": {"saturation"},
    "front_panel": {"units changed", "bad reply"},
    "lamp_out": {"lamp out of band"},
}
POWER_CUT = {
    "stages": {"homing lost", "bad reply", "no reply", "command error"},
    "spectrometer": {"reset"},
    "reference": {"bad reply"},
}


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The same plan without any fault."""
    folder = tmp_path_factory.mktemp("clean")
    with emulation(folder) as (rig_path, _, _):
        measure(write_plan(folder, **PLAN), rig_path, folder / "scan.h5", budget=POINTS_ONLY)
    return Scan.open(folder / "scan.h5")


CASES = [(instrument, fault) for instrument, faults in FAULTS.items() for fault in faults]


@pytest.mark.parametrize(("points", "exchanges"), [(3, 0), (4, 7)])
@pytest.mark.parametrize(("instrument", "fault"), CASES)
def test_fault(tmp_path, clean, instrument, fault, points, exchanges):
    """Injected when some points are committed and the instrument has had some more exchanges."""
    events = []

    with emulation(tmp_path, seed=points, **QUICK) as (rig_path, _, emulated):

        def inject(done, total):
            if done == points and not emulated.injector.injected:
                now = emulated.instruments[instrument].exchanges
                emulated.injector.inject(instrument, fault, at=now + exchanges)

        measure(
            write_plan(tmp_path, **PLAN),
            rig_path,
            tmp_path / "scan.h5",
            budget=POINTS_ONLY,
            show=events.append,
            report=inject,
        )
        assert [i.fault for i in emulated.injector.injected] == [fault]
    scan, raw = Scan.open(tmp_path / "scan.h5"), read_raw(tmp_path / "scan.h5")
    expected = POWER_CUT[instrument] if fault == "power_cut" else EXPECTED[fault]
    assert expected & {event.kind for event in events}, [str(e) for e in events]
    assert all(str(event) in raw.log for event in events)
    measured = ~scan.mask.any(axis=1)
    assert np.count_nonzero(~measured) == (fault == "limit_switch")
    assert np.array_equal(scan.theta_r[measured], clean.theta_r[measured])
    if fault == "saturation":
        # The repeat with a shorter time has coarser counts.
        assert scan.brdf == pytest.approx(clean.brdf, rel=0.02)
    else:
        assert np.array_equal(scan.brdf[measured], clean.brdf[measured])
    if fault == "limit_switch":
        assert scan.flag_counts()["limit_switch"] == len(scan.wavelength)
    if fault in ("homing_lost", "stall") or (instrument == "stages" and fault in ("unplug", "power_cut")):
        assert np.count_nonzero(raw.rows["kind"] == CHECK) >= 1, "a check point after homing again"


def test_many_faults_of_one_kind(tmp_path, clean):
    """Faults upon faults, also while others are being mended."""
    names = '["lost_command_byte", "stale_reply", "homing_lost", "power_cut"]'
    options = {"fault_rate": 0.01, "emulator": f"faults = {names}", "seed": 3, "attempts": 30, **QUICK}
    with emulation(tmp_path, **options) as (p, _, e):
        measure(write_plan(tmp_path, **PLAN), p, tmp_path / "scan.h5", budget=POINTS_ONLY)
        assert len(e.injector.injected) >= 3
    assert np.array_equal(Scan.open(tmp_path / "scan.h5").brdf, clean.brdf)


@pytest.mark.parametrize(
    ("instrument", "fault", "told"),
    [
        ("spectrometer", "unplug", "replugged"),
        ("spectrometer", "no_reply", "no reply"),
        ("stages", "unplug", "replugged"),
    ],
)
def test_a_fault_in_the_very_last_exchange(tmp_path, clean, monkeypatch, instrument, fault, told):
    """The shutter is closed all the same, and the log tells."""
    make_safe, events = Instruments.make_safe, []
    with emulation(tmp_path, **QUICK) as (rig_path, _, emulated):

        def disturbed(instruments):
            emulated.injector.inject(instrument, fault)
            make_safe(instruments)

        monkeypatch.setattr(Instruments, "make_safe", disturbed)
        measure(
            write_plan(tmp_path, **PLAN),
            rig_path,
            tmp_path / "scan.h5",
            budget=POINTS_ONLY,
            show=events.append,
        )
        assert [i.fault for i in emulated.injector.injected] == [fault]
        assert not emulated.world.is_open
    assert told in [event.kind for event in events]
    assert np.array_equal(Scan.open(tmp_path / "scan.h5").brdf, clean.brdf)


def test_a_stop_that_was_asked_for_does_not_keep_the_shutter_open(tmp_path):
    """Asked to stop, with the spectrometer unplugged in the last exchange: closed, without an exception."""

    def stop():
        raise StoppedError

    with emulation(tmp_path, **QUICK) as (_, rig, emulated), connected(rig, emulated) as (instruments, log):
        instruments.spectrometer.set_shutter(True)
        assert emulated.world.is_open
        emulated.injector.inject("spectrometer", "unplug")
        replace(instruments, check=stop).make_safe()
        assert not emulated.world.is_open
    assert "replugged" in [event.kind for event in log.events]


def test_an_interrupt_while_the_shutter_is_closed_waits_for_it(tmp_path, monkeypatch):
    """As where Ctrl-C is pressed twice: the second one comes amid the last commands."""
    close, calls = Instruments._close_shutter, []

    def interrupted(self):
        calls.append(None)
        if len(calls) == 1:
            raise KeyboardInterrupt
        close(self)

    with emulation(tmp_path, **QUICK) as (_, rig, emulated), connected(rig, emulated) as (instruments, _):
        instruments.spectrometer.set_shutter(True)
        monkeypatch.setattr(Instruments, "_close_shutter", interrupted)
        with pytest.raises(KeyboardInterrupt):
            instruments.make_safe()
        assert not emulated.world.is_open


def test_a_shutter_that_does_not_close_is_told(tmp_path, monkeypatch):
    events = []

    def dead(self):
        raise InstrumentError("it does not answer")

    with emulation(tmp_path, **QUICK) as (rig_path, _, _):
        monkeypatch.setattr(Instruments, "_close_shutter", dead)
        measure(
            write_plan(tmp_path, **PLAN),
            rig_path,
            tmp_path / "scan.h5",
            budget=POINTS_ONLY,
            show=events.append,
        )
    (event,) = [event for event in events if event.kind == "not safe"]
    assert str(event).endswith("could not close the shutter: it does not answer; see to it by hand")


def test_lamp_stays_out_of_band(tmp_path):
    with emulation(tmp_path) as (rig_path, _, emulated):
        rig_path.write_text(rig_path.read_text().replace("wait = 20", "wait = 0.05"))
        plan = write_plan(tmp_path, **PLAN)
        points = []

        def dim(done, total):
            points.append(done)
            if done == 3:
                emulated.world.settings = emulated.world.settings.model_copy(update={"reference_power": 5e-4})

        with pytest.raises(InstrumentError, match="see to the lamp; 3 of 8 points"):
            measure(plan, rig_path, tmp_path / "scan.h5", report=dim)
        emulated.world.settings = emulated.world.settings.model_copy(update={"reference_power": 1e-3})
        assert measure(plan, rig_path, tmp_path / "scan.h5", resume=True).points == 8


def test_check_point_that_moved(tmp_path):
    """The sample is exchanged while the measurement is interrupted: --resume notices."""
    plan = write_plan(tmp_path, **PLAN)

    class EnoughError(Exception):
        pass

    def stop(done, total):
        if done == 4:
            raise EnoughError

    with emulation(tmp_path) as (rig_path, _, emulated):
        with pytest.raises(EnoughError):
            measure(plan, rig_path, tmp_path / "scan.h5", report=stop)
        emulated.world._direct = emulated.world._direct * 1.5
        emulated.world._seen = None
        with pytest.raises(InstrumentError, match=r"check point \d is \+5\d\.\d\d% off"):
            measure(plan, rig_path, tmp_path / "scan.h5", resume=True)


def test_disk_nearly_full(tmp_path):
    words = r"MB free, 1e\+12 MB are to be kept"
    with (
        emulation(tmp_path, keep_free=1e12) as (rig_path, _, _),
        pytest.raises(StorageError, match=words),
    ):
        measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5")
    assert not (tmp_path / "scan.h5").exists()


def test_disk_fills_up_on_the_way(tmp_path, clean, monkeypatch):
    """Stops early with the file intact; goes on when there is space again."""
    from clbrdf.rig import segment

    real, calls = segment.shutil.disk_usage, []

    def usage(path):
        calls.append(path)
        return real(path)._replace(free=0 if len(calls) > 6 else 10**12)

    plan = write_plan(tmp_path, **PLAN)
    with emulation(tmp_path, keep_free=1.0) as (rig_path, _, _):
        monkeypatch.setattr(segment.shutil, "disk_usage", usage)
        with pytest.raises(StorageError, match="free some space, then go on with resume=True"):
            measure(plan, rig_path, tmp_path / "scan.h5")
        assert sum(len(read_rows(p)["kind"]) for p in segments(tmp_path / "scan.h5.run")) == 6
        monkeypatch.setattr(segment.shutil, "disk_usage", real)
        measure(plan, rig_path, tmp_path / "scan.h5", resume=True, budget=POINTS_ONLY)
    assert np.array_equal(Scan.open(tmp_path / "scan.h5").brdf, clean.brdf)


def test_disk_refuses_a_write(tmp_path, clean):
    """HDF5 meets an error in the middle of a row: one line, no crash at exit, and it can be resumed."""
    limited = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (90_000, 90_000))\n"
        "from clbrdf.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    plan, out = write_plan(tmp_path, **PLAN), tmp_path / "scan.h5"
    with emulation(tmp_path) as (rig_path, _, _):
        words = ["measure", str(plan), "--rig", str(rig_path), "-o", str(out)]
        done = subprocess.run(
            [sys.executable, "-c", limited, *words], capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 2
        assert "File too large" in done.stderr
        assert "go on with --resume" in done.stderr
        assert done.stderr.count("\n") == 1
        rows = sum(len(read_rows(p)["kind"]) for p in segments(run_folder(out)))
        assert f"the {rows} rows before are safe" in done.stderr
        assert rows > 2
        measure(plan, rig_path, out, resume=True, budget=POINTS_ONLY)
    assert np.array_equal(Scan.open(out).brdf, clean.brdf)


def nothing_moved(emulated):
    axes = emulated.devices["stages"].axes.values()
    return all(axis.state == RESET and axis.place == 3.0 and axis.move is None for axis in axes)


def connect(rig):
    instruments = make_instruments(rig, EventLog(), never)
    try:
        instruments.connect()
    finally:
        instruments.close()


def test_no_such_port(tmp_path):
    with pytest.raises(InstrumentError, match=r"stages: no port .*ports/stages; check the cable"):
        measure(write_plan(tmp_path), write_rig(tmp_path), tmp_path / "scan.h5")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["plan.toml", "rig.toml"]


def test_port_that_is_a_file(tmp_path):
    path = write_rig(tmp_path)
    (tmp_path / "ports").mkdir()
    (tmp_path / "ports" / "stages").write_text("no port")
    with pytest.raises(InstrumentError, match="no serial port that can be used"):
        connect(load_rig(path))
    with pytest.raises(InputError, match="exists and is no emulated port"), EmulatedRig(load_rig(path)):
        pass
    assert (tmp_path / "ports" / "stages").read_text() == "no port"


def test_busy_port(tmp_path):
    with emulation(tmp_path) as (_, rig, emulated):
        first = make_instruments(rig, EventLog(), never)
        first.connect()
        with pytest.raises(InstrumentError, match="in use by another program"):
            connect(rig)
        first.close()
        connect(rig)
        assert nothing_moved(emulated)


@pytest.mark.parametrize(
    ("one", "other", "words"),
    [
        ("stages", "reference", "stages: no SMC100 at address 1 answers"),
        ("spectrometer", "reference", "spectrometer: no OBP spectrometer answers"),
        ("stages", "spectrometer", "stages: no SMC100 at address 1 answers"),
    ],
)
def test_port_of_another_instrument(tmp_path, one, other, words):
    with emulation(tmp_path, **QUICK) as (rig_path, _, emulated):
        text = rig_path.read_text()
        swapped = text.replace(f"ports/{one}", "X").replace(f"ports/{other}", f"ports/{one}")
        rig_path.write_text(swapped.replace('"X"', f'"ports/{other}"'))
        with pytest.raises(InstrumentError, match=words):
            measure(write_plan(tmp_path), rig_path, tmp_path / "scan.h5")
        assert nothing_moved(emulated)
    assert not (tmp_path / "scan.h5.run").exists()


def test_wavelengths_beyond_the_spectrometer(tmp_path):
    plan = write_plan(tmp_path)
    plan.write_text(plan.read_text().replace("start = 500", "start = 200"))
    with emulation(tmp_path) as (rig_path, _, emulated):
        with pytest.raises(InputError, match=r"the spectrometer gives 339\.8 to 799"):
            measure(plan, rig_path, tmp_path / "scan.h5")
        assert nothing_moved(emulated)

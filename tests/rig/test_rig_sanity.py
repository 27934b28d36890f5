"""What cannot be true is said, and loudly: no light, clipping, a sample that moved, damaged files."""

import struct
import time

import numpy as np
import pytest
from rig_helpers import emulation, write_plan, write_rig

from clbrdf.cli import main
from clbrdf.errors import InputError
from clbrdf.rig import segmentcheck
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.errors import InstrumentError
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import DARK
from clbrdf.rig.segment import read_rows
from clbrdf.rig.segmentcheck import check_segments
from clbrdf.rig.store import run_folder, segments
from clbrdf.scan import Scan

PLAN = {"step": 20.0, "time": 0.05}
NOISE = "shot_noise = true\nread_noise = 3.0"


class EnoughError(Exception):
    pass


def stop_after(points):
    def report(done, total):
        if done == points:
            raise EnoughError

    return report


def measured(folder, plan=None, **options):
    with emulation(folder, **options) as (rig_path, _, _):
        out = folder / "scan.h5"
        outcome = measure(plan or write_plan(folder, **PLAN), rig_path, out, budget=POINTS_ONLY)
        return Scan.open(out), read_raw(out), outcome


@pytest.mark.parametrize(
    "effects", [NOISE, "", NOISE + '\nshutter_stuck = "closed"', 'shutter_stuck = "open"']
)
def test_no_light_in_the_direct_beam(tmp_path, effects):
    """Lamp off or fibre out, with and without noise; a shutter that stays closed, or open."""
    path = write_rig(tmp_path, effects=effects)
    if "stuck" not in effects:
        path.write_text(path.read_text().replace("direct_rate = 1.0e8", "direct_rate = 1.0e-3"))
    words = r"the direct beam is .* where 10 are needed: see that the lamp is on, the shutter opens"
    with EmulatedRig(load_rig(path)), pytest.raises(InstrumentError, match=words):
        measure(write_plan(tmp_path, **PLAN), path, tmp_path / "scan.h5")
    assert not (tmp_path / "scan.h5").exists()


def test_a_dead_reference_detector(tmp_path):
    """0.0E+0 W is no light, not a number to divide by; it is waited for once, not eight times."""
    with emulation(tmp_path) as (rig_path, _, emulated):
        rig_path.write_text(rig_path.read_text().replace("wait = 20", "wait = 0.05"))
        emulated.world.reference_reading = lambda: 0.0
        with pytest.raises(InstrumentError, match=r"less than reference\.least .*no light"):
            measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -5.0, 0.0])
def test_nonlinearity_coefficients_that_cannot_be(tmp_path, value):
    with emulation(tmp_path) as (rig_path, _, emulated):
        emulated.devices["spectrometer"].nonlinearity = [value, 0.0]
        with pytest.raises(InstrumentError, match=r"nonlinearity .*again"):
            measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5")
        assert all(axis.place == 3.0 for axis in emulated.devices["stages"].axes.values()), "nothing moved"


@pytest.mark.parametrize("coefficients", [(float("nan"), 0.5), (340.0, 0.0), (340.0, -0.4)])
def test_wavelength_coefficients_that_cannot_be(tmp_path, monkeypatch, coefficients):
    from clbrdf.rig.emulator import spectrometer

    with emulation(tmp_path) as (rig_path, _, _):
        monkeypatch.setattr(spectrometer, "WAVELENGTH_COEFFICIENTS", coefficients)
        with pytest.raises(InstrumentError, match=r"wavelength.* again"):
            measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5")


def test_a_constant_spectrum(tmp_path):
    """A detector that gives the same counts whatever it sees."""
    with emulation(tmp_path) as (rig_path, _, emulated):
        emulated.world.counts = lambda seconds, began: np.full(1024, 5000, np.uint16)
        with pytest.raises(InstrumentError, match="direct beam is 0 counts above dark"):
            measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5")


def test_the_fibre_comes_out_on_the_way(tmp_path, capsys):
    """Points after it look like a black sample; the direct beam at the end does not."""
    with emulation(tmp_path, effects=NOISE) as (rig_path, _, emulated):

        def out(done, total):
            if done == 4:
                emulated.world._direct = emulated.world._direct * 0.0
                emulated.world._seen = None

        with pytest.raises(InstrumentError, match=r"direct beam .*; 8 of 8 points are safe"):
            measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5", report=out)


def test_a_direct_beam_that_changed_is_said_at_the_end(tmp_path, capsys, monkeypatch):
    """The fibre slips by 20 %: the scan is written, the status is 1, and one line says so."""
    from clbrdf.rig import acquire

    with emulation(tmp_path, effects=NOISE) as (rig_path, _, emulated):
        commit = acquire.Acquisition._commit

        def slip(self, row):
            commit(self, row)
            if row.point == 3:
                emulated.world._direct = emulated.world._direct * 0.8
                emulated.world._seen = None

        monkeypatch.setattr(acquire.Acquisition, "_commit", slip)
        words = [
            "measure",
            str(write_plan(tmp_path, **PLAN)),
            "--rig",
            str(rig_path),
            "-o",
            str(tmp_path / "scan.h5"),
        ]
        assert main(words) == 1
    err = capsys.readouterr().err
    assert "clbrdf: the direct beam was -2" in err
    assert (tmp_path / "scan.h5").exists()


def test_reference_detector_behind_the_shutter(tmp_path):
    scan, raw, _ = measured(tmp_path, effects="reference_behind_shutter = true")
    assert raw.rows["reference_power"].min() == 1e-3
    assert scan.flag_counts() == {}


def interrupted(folder, points, **options):
    with emulation(folder, **options) as (rig_path, _, _), pytest.raises(EnoughError):
        measure(write_plan(folder, **PLAN), rig_path, folder / "scan.h5", report=stop_after(points))
    return folder / "scan.h5"


@pytest.mark.parametrize(("change", "is_found"), [(0.92, True), (1.08, True), (0.999, False), (1.0, False)])
def test_a_sample_that_changed_during_the_break(tmp_path, change, is_found):
    with emulation(tmp_path, effects=NOISE) as (rig_path, _, emulated):
        out, plan = tmp_path / "scan.h5", write_plan(tmp_path, **PLAN)
        with pytest.raises(EnoughError):
            measure(plan, rig_path, out, report=stop_after(4))
        surface = emulated.world._surface
        emulated.world._surface = lambda directions: surface(directions) * change
        emulated.world._seen = None
        if is_found:
            with pytest.raises(InstrumentError, match="of its standard deviations, more than 5"):
                measure(plan, rig_path, out, resume=True)
        else:
            assert measure(plan, rig_path, out, resume=True).points == 8


def test_colour_that_changed_during_the_break(tmp_path):
    """The sum over the spectrum stays; its parts do not."""
    with emulation(tmp_path, effects=NOISE) as (rig_path, _, emulated):
        out, plan = tmp_path / "scan.h5", write_plan(tmp_path, **PLAN)
        with pytest.raises(EnoughError):
            measure(plan, rig_path, out, report=stop_after(4))
        tilt = 1.0 + 0.1 * (emulated.world.wavelength - 550.0) / 50.0
        surface = emulated.world._surface
        emulated.world._surface = lambda directions: surface(directions) * tilt
        emulated.world._seen = None
        with pytest.raises(InstrumentError, match="of its standard deviations, more than 5"):
            measure(plan, rig_path, out, resume=True)


def test_a_detector_that_clips_below_its_full_scale(tmp_path):
    """An amplifier that is full at 9000 counts: seen by the plateau, or by the full scale that is set."""
    plan = write_plan(tmp_path, time=0.5)
    clean, _, _ = measured(tmp_path, plan)
    for name, options in (("seen", {}), ("set", {"spectrometer": "full_scale = 9000"})):
        folder = tmp_path / name
        folder.mkdir()
        scan, raw, _ = measured(folder, write_plan(folder, time=0.5), effects="clip = 9000", **options)
        assert "saturation" in raw.log
        assert scan.brdf == pytest.approx(clean.brdf, rel=5e-3), name
        assert scan.flag_counts() == {}


@pytest.mark.parametrize(("line", "words"), [("margin = 0.05", "margin"), ("full_scale = 0", "full_scale")])
def test_full_scale_that_cannot_be(tmp_path, line, words):
    with pytest.raises(InputError, match=words), emulation(tmp_path, spectrometer=line):
        pass


def test_saturated_values_are_many(tmp_path, capsys):
    """Flagged, counted, one loud line, status 1."""
    plan = write_plan(tmp_path, more="shortest_time = 0.05\nlongest_time = 0.05")
    plan.write_text(plan.read_text().replace("step = 10.0", "step = 5.0"))
    with emulation(tmp_path) as (rig_path, _, emulated):
        share = emulated.world._share
        emulated.world._share = lambda axes: 2e-3 if (s := share(axes)) is None or np.all(s == 1.0) else s
        assert main(["measure", str(plan), "--rig", str(rig_path), "-o", str(tmp_path / "scan.h5")]) == 1
    captured = capsys.readouterr()
    assert "flagged saturated" in captured.out
    assert "values are flagged (saturated" in captured.err
    assert len(captured.err.strip().splitlines()) == 1


def test_the_dark_ages_by_time(tmp_path):
    plan = write_plan(tmp_path, dark_every=1000, time=0.05, more="dark_time = 0.05")
    _, raw, _ = measured(tmp_path, plan)
    darks = np.count_nonzero(raw.rows["kind"] == DARK)
    (tmp_path / "long").mkdir()
    _, other, _ = measured(tmp_path / "long", write_plan(tmp_path / "long", dark_every=1000, time=0.05))
    assert darks > np.count_nonzero(other.rows["kind"] == DARK)


def test_the_dark_ages_by_temperature(tmp_path):
    with emulation(tmp_path) as (rig_path, _, _):
        from clbrdf.rig.emulator import spectrometer

        def warm(done, total):
            spectrometer.TEMPERATURE = 31.5 + 0.4 * (done >= 3) + 0.4 * (done >= 5)

        plan = write_plan(tmp_path, dark_every=1000, time=0.05)
        try:
            measure(plan, rig_path, tmp_path / "scan.h5", report=warm, budget=POINTS_ONLY)
        finally:
            spectrometer.TEMPERATURE = 31.5
    rows = read_raw(tmp_path / "scan.h5").rows
    points = rows["kind"] == 0
    warmth = rows["temperature"][points] - rows["temperature"][rows["dark"][points]]
    assert np.abs(warmth).max() < 0.5
    assert rows["temperature"][points].max() > 32.0


def test_a_changed_wait_is_no_other_rig(tmp_path):
    """What only says how long to wait, and in which order to home, may change on resume."""
    changes = {
        "wait = 20": "wait = 30",
        "band = 0.05": "band = 0.1",
        "poll = 0.0002": "poll = 0.001",
        "homing_time = 4.0": 'homing_time = 5.0\nhoming_order = ["turn", "lamp", "pitch"]',
    }
    out = interrupted(tmp_path, 3)
    with emulation(tmp_path) as (rig_path, _, _):
        text = rig_path.read_text()
        for before, after in changes.items():
            assert before in text
            text = text.replace(before, after)
        rig_path.write_text(text)
        assert measure(tmp_path / "plan.toml", rig_path, out, resume=True).points == 8


def test_a_changed_solid_angle_is_another_rig(tmp_path):
    out = interrupted(tmp_path, 3)
    with emulation(tmp_path) as (rig_path, _, _):
        rig_path.write_text(rig_path.read_text().replace("solid_angle = 1.0e-3", "solid_angle = 2.0e-3"))
        with pytest.raises(InputError, match="begun with another rig"):
            measure(tmp_path / "plan.toml", rig_path, out, resume=True)


@pytest.fixture(scope="module")
def a_segment(tmp_path_factory):
    """Bytes of a segment whose writer went away."""
    return segments(run_folder(interrupted(tmp_path_factory.mktemp("segment"), 6)))[0].read_bytes()


@pytest.mark.parametrize("share", [0.9, 0.6, 0.4, 0.2, 0.05, 0.003])
def test_a_segment_cut_short(tmp_path, a_segment, share):
    """HDF5 would look for what is missing for minutes; we say so at once, without any instrument."""
    folder = run_folder(tmp_path / "scan.h5")
    folder.mkdir()
    (folder / "segment-0000.h5").write_bytes(a_segment[: int(len(a_segment) * share)])
    rig_path = write_rig(tmp_path)
    began = time.monotonic()
    with pytest.raises(InputError, match=r"cut short|damaged segment"):
        measure(write_plan(tmp_path, **PLAN), rig_path, tmp_path / "scan.h5", resume=True)
    assert time.monotonic() - began < 5.0


def rows_or_error(path):
    """The rows of a segment once it has been looked at from outside, or the line that says why not."""
    try:
        check_segments([path])
        return read_rows(path)
    except InputError as error:
        words = str(error)
    assert "damaged segment" in words or "is damaged" in words
    assert "\n" not in words
    return words


def zeroed(data, place, blocks=40):
    block = len(data) // blocks
    return data[: place * block] + bytes(block) + data[(place + 1) * block :]


def all_but_the_last(found, rows):
    count = len(found["kind"])
    assert count >= len(rows["kind"]) - 1
    assert all(found[name].tobytes() == rows[name][:count].tobytes() for name in rows)


@pytest.mark.parametrize("place", [0, 5, 12, 25, 33, 39])
def test_a_zeroed_block(tmp_path, a_segment, monkeypatch, place):
    """A block of the file set to zero: the rows are whole, or one line says that they are not."""
    monkeypatch.setattr(segmentcheck, "START_TIME", 6.0)
    path = tmp_path / "segment-0000.h5"
    path.write_bytes(a_segment)
    rows = read_rows(path)
    path.write_bytes(zeroed(a_segment, place))
    found = rows_or_error(path)
    if not isinstance(found, str):
        all_but_the_last(found, rows)


@pytest.mark.soak
def test_every_zeroed_block(tmp_path, a_segment, monkeypatch):
    monkeypatch.setattr(segmentcheck, "START_TIME", 6.0)
    path = tmp_path / "segment-0000.h5"
    path.write_bytes(a_segment)
    rows = read_rows(path)
    said = 0
    for place in range(160):
        path.write_bytes(zeroed(a_segment, place, 160))
        found = rows_or_error(path)
        said += isinstance(found, str)
        if not isinstance(found, str):
            all_but_the_last(found, rows)
    print(f"160 blocks, {said} of them end in one line")
    assert said > 20


def test_the_end_of_a_sane_file_is_where_hdf5_says(tmp_path):
    """The committed length never exceeds the file's: HDF5 extends the file before we count the row."""
    path = segments(run_folder(interrupted(tmp_path, 6)))[0]
    (end,) = struct.unpack_from("<Q", path.read_bytes(), 28)
    assert end <= path.stat().st_size

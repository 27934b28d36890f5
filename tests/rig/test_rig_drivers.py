"""One suite for every driver: identify, another model, limits, lost replies, foreign states."""

import numpy as np
import pytest
from fake_instruments import Esp, Kdc101, Pm100, Sr830, kinesis_motor, visa_adapter
from rig_helpers import context, settings, with_spectrometer, write_plan, write_rig

from clbrdf.errors import InputError
from clbrdf.rig import drivers
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.errors import InstrumentError, LineError, NoReplyError, RefusedError, UnpluggedError
from clbrdf.rig.measure import measure
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.roles import Motion
from clbrdf.scan import Scan

pymeasure = pytest.importorskip("pymeasure", reason="the extra pymeasure is not installed")
pylablib = pytest.importorskip("pylablib", reason="the extra pylablib is not installed")
seabreeze = pytest.importorskip("seabreeze", reason="the extra seabreeze is not installed")


@pytest.fixture
def visa(monkeypatch):
    """Instruments by resource; drivers open them through pymeasure."""
    from clbrdf.rig.drivers import _visa

    known = {}

    def open_adapter(resource, timeout):
        if resource not in known:
            raise OSError("VI_ERROR_RSRC_NFOUND (-1073807343): Insufficient location information")
        return visa_adapter(known[resource])

    monkeypatch.setattr(_visa, "open_adapter", open_adapter)
    return known


@pytest.fixture
def cubes(monkeypatch):
    from pylablib.devices import Thorlabs

    known = {}
    monkeypatch.setattr(Thorlabs, "KinesisMotor", kinesis_motor(known))
    return known


def esp300(visa):
    visa["GPIB0::1"] = Esp()
    module = drivers.get_driver("stages", "esp300")
    axes = {name: module.Axis(axis=k) for k, name in enumerate(("lamp", "turn", "pitch"), start=1)}
    return module.connect(settings("esp300", "stages", resource="GPIB0::1"), axes, context("stages")), visa[
        "GPIB0::1"
    ]


def kinesis(cubes):
    names = {"lamp": "27000001", "turn": "27000002"}
    for serial in names.values():
        cubes[serial] = Kdc101(int(serial))
    module = drivers.get_driver("stages", "kinesis")
    axes = {name: module.Axis(serial=serial) for name, serial in names.items()}
    return module.connect(None, axes, context("stages")), cubes["27000001"]


def manual(_):
    module = drivers.get_driver("stages", "manual")
    return module.connect(None, dict.fromkeys(("lamp", "turn"), None), context("stages")), None


STAGES = [(esp300, "visa"), (kinesis, "cubes"), (manual, "visa")]


@pytest.fixture(params=STAGES, ids=[make.__name__ for make, _ in STAGES])
def stages(request):
    make, needs = request.param
    return make(request.getfixturevalue(needs))


def homed(stage):
    for _ in range(100):
        if stage.is_unreferenced():
            break
    stage.start_homing()
    for _ in range(2000):
        if stage.get_status().motion is Motion.READY:
            return stage
    raise AssertionError("does not home")


def arrived(stage):
    for _ in range(2000):
        if stage.get_status().motion is Motion.READY:
            return stage.get_position(0.01)
    raise AssertionError("does not arrive")


def test_stages_move(stages):
    group, fake = stages
    assert not group.is_open
    group.open()
    assert group.is_open
    assert group.identify()
    for stage in group.stages.values():
        assert stage.get_status().motion in (Motion.NOT_REFERENCED, Motion.READY)
        homed(stage)
        stage.configure((-90.0, 170.0), 10.0, 20.0)
        stage.start_move(123.4567)
        assert arrived(stage) == pytest.approx(123.4567, abs=6e-4), "one count of the encoder, at most"
        stage.start_move(-20.0)
        assert arrived(stage) == pytest.approx(-20.0, abs=6e-4)
    group.stop()
    assert getattr(fake, "refused", []) == []
    assert getattr(fake, "unknown", []) == []
    group.close()
    assert not group.is_open


def test_stages_refuse_what_is_beyond_their_limits(stages):
    group, _ = stages
    group.open()
    stage = homed(next(iter(group.stages.values())))
    stage.configure((-90.0, 90.0), 10.0, 20.0)
    before = stage.get_position(0.01)
    if type(stage).__name__ == "ManualStage":
        stage.context = context("stages", ["120", "91", "45"])
        stage.start_move(45.0)
        assert stage.get_position(0.01) == 45.0, "120° cannot have been read off"
        return
    try:
        stage.start_move(120.0)
    except RefusedError:
        pass
    else:
        assert stage.get_status().errors, "the controller says so"
    assert stage.get_position(0.01) == before


def test_stages_that_lose_a_reply_or_the_connection(stages):
    group, fake = stages
    if fake is None:
        pytest.skip("a person does not answer by wire")
    group.open()
    stage = homed(group.stages["lamp"])
    fake.lose_next = True
    with pytest.raises(LineError):
        stage.get_status()
    assert stage.get_status().motion is Motion.READY
    fake.is_lost = True
    with pytest.raises(UnpluggedError, match="plug it in again"):
        stage.get_position(0.01)
    assert not group.is_open
    fake.is_lost = False
    group.open()
    assert group.is_open


def test_an_esp300_that_was_switched_off_is_not_referenced(visa):
    group, fake = esp300(visa)
    group.open()
    stage = homed(group.stages["turn"])
    fake.axes[2] |= {"on": 0, "at": 7.0}
    assert stage.get_status().motion is Motion.NOT_REFERENCED
    fake.errors += [203, 104]
    status = stage.get_status()
    assert status.stalled
    assert not status.limit
    assert group.stages["lamp"].get_status().limit, "another axis's error is kept for it"


def test_kinesis_errors_and_scale(cubes):
    group, fake = kinesis(cubes)
    group.open()
    stage = homed(group.stages["lamp"])
    fake.bits = 1 << 14
    assert stage.get_status().stalled
    fake.bits = 1
    assert stage.get_status().limit
    with pytest.raises(InstrumentError, match="no Kinesis controller 27999999 is connected"):
        one = drivers.get_driver("stages", "kinesis")
        one.connect(None, {"lamp": one.Axis(serial="27999999")}, context("stages")).open()
    cubes["27000003"] = Kdc101(27000003)
    with pytest.raises(InstrumentError, match=r"scaled in m, not degrees; name it"):
        one.connect(None, {"lamp": one.Axis(serial="27000003", stage="MTS50-Z8")}, context("stages")).open()


METERS = {"pm100usb": (Pm100, "USB0::0x1313"), "sr830": (Sr830, "GPIB0::8")}


@pytest.mark.parametrize("name", METERS)
def test_another_model_is_named(visa, name):
    """A resource where something else answers."""
    kind, resource = METERS[name]
    fake = visa[resource] = kind()
    fake.identity = "Keithley Instruments Inc., Model 2000, 1234, A01"
    detector = drivers.get_driver("spectrometer", name).connect(
        settings(name, "spectrometer", resource=resource, wavelengths=[550.0]), context()
    )
    detector.open()
    with pytest.raises(InstrumentError, match=rf"{resource} is 'Keithley"):
        detector.identify()
    missing = settings(name, "spectrometer", resource="GPIB0::29", wavelengths=[550.0])
    with pytest.raises(InstrumentError, match=r"GPIB0::29 cannot be opened .* check the resource"):
        drivers.get_driver("spectrometer", name).connect(missing, context()).open()


def test_pm100_left_in_a_foreign_state(visa):
    """dBm, a loss of 10 dB, 3000 averages, another wavelength."""
    fake = visa["USB0::0x1313"] = Pm100()
    meter = drivers.get_driver("reference", "pm100usb").connect(
        settings("pm100usb", "reference", resource="USB0::0x1313"), context("reference")
    )
    meter.open()
    assert "S120C" in meter.identify()
    meter.configure(550.0, 0.001)
    assert meter.measure_power() == pytest.approx(1e-3)
    assert fake.state == {"UNIT": "W", "RANG:AUTO": "1", "WAV": 550.0, "MAGN": 0.0, "COUN": 1}
    assert fake.refused == []
    fake.power = lambda: 9.9e37
    with pytest.raises(InstrumentError, match="over its range"):
        meter.measure_power()
    fake.lose_next = True
    with pytest.raises(NoReplyError):
        meter.measure_power()
    with pytest.raises(InstrumentError, match="stays 1100 nm"):
        meter.configure(1300.0, 0.001)


def test_lock_in_as_detector(visa):
    fake = visa["GPIB0::8"] = Sr830(lambda: 2.5e-3)
    detector = drivers.get_driver("spectrometer", "sr830").connect(
        settings("sr830", "spectrometer", resource="GPIB0::8", wavelengths=[633.0]), context()
    )
    detector.open()
    assert "SR830" in detector.identify()
    detector.set_shutter(True)
    assert detector.measure_spectrum().tolist() == [2_500_000 + 10_000]
    fake.volts = lambda: 2.0
    assert detector.measure_spectrum().tolist() == [detector.full_scale], "an overload is a saturation"
    fake.volts = lambda: 2.5e-3
    assert detector.measure_spectrum().tolist() == [2_510_000], "what was latched before does not count"
    detector.set_shutter(False)
    assert detector.measure_spectrum().tolist() == [10_000]
    assert fake.refused == []


def test_a_whole_scan_with_a_lock_in(tmp_path, visa):
    """One wavelength, volts that follow the emulated surface; pymeasure's own code in between."""
    text = (
        '[spectrometer]\ndriver = "sr830"\nresource = "GPIB0::8"\nwavelengths = [550]\nunit = 1e-8\n'
        "shutter_time = 0\n"
    )
    path = with_spectrometer(tmp_path, text)
    with EmulatedRig(load_rig(path)) as emulated:
        world = emulated.world
        place = int(np.argmin(np.abs(world.wavelength - 550.0)))
        full = world._direct[place]
        visa["GPIB0::8"] = Sr830(lambda: 0.5 * float(world.rate()[place]) / full)
        outcome = measure(write_plan(tmp_path, step=20.0), path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    scan = Scan.open(tmp_path / "scan.h5")
    assert outcome.points == 8
    assert scan.wavelength.tolist() == [550.0]
    from test_rig_measure import model_values

    # One count is 10 nV of 0.5 V: 2e-8 of the direct beam; f Ω cosθ is 3e-4 and more.
    assert scan.brdf == pytest.approx(model_values(scan), rel=2e-4)
    assert visa["GPIB0::8"].refused == []


def test_a_whole_scan_with_a_power_meter_and_filters(tmp_path, visa, monkeypatch):
    """Two filters that a person changes."""
    text = (
        '[spectrometer]\ndriver = "pm100usb"\nresource = "USB0::0x1313"\nwavelengths = [520, 580]\n'
        'unit = 1e-10\nshutter = "none"\nshutter_time = 0\nread_noise = 2\n'
    )
    path = with_spectrometer(tmp_path, text)
    with EmulatedRig(load_rig(path)) as emulated:
        world, filters = emulated.world, {520: 0.0, 580: 0.0}
        seen = {"at": 520}

        def ask(question):
            seen["at"] = 520 if "520" in question else 580
            filters[seen["at"]] += 1
            return ""

        def power():
            place = int(np.argmin(np.abs(world.wavelength - seen["at"])))
            return 1e-2 * float(world.rate()[place]) / world._direct[place]

        visa["USB0::0x1313"] = Pm100(power)
        plan = write_plan(tmp_path, step=30.0)
        measure(plan, path, tmp_path / "scan.h5", budget=POINTS_ONLY, ask=ask)
    scan = Scan.open(tmp_path / "scan.h5")
    assert scan.wavelength.tolist() == [520.0, 580.0]
    assert min(filters.values()) >= len(scan.theta_i)
    from test_rig_measure import model_values

    assert scan.brdf == pytest.approx(np.broadcast_to(model_values(scan), scan.brdf.shape), rel=1e-3)


def test_a_missing_extra_is_named(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "seabreeze.spectrometers", None)
    driver = drivers.get_driver("spectrometer", "seabreeze")
    with pytest.raises(InstrumentError, match=r"pip install 'clbrdf\[seabreeze\]'"):
        driver.connect(settings("seabreeze", "spectrometer"), context()).open()


def test_axes_of_different_makers(tmp_path, cubes):
    """The lamp by SMC100, the turn by a K-Cube, the pitch by hand: each has its own keys."""
    path = write_rig(tmp_path)
    text = path.read_text()
    text = text.replace("turn  = { address = 2,", 'turn  = { driver = "kinesis", serial = "27000001",')
    path.write_text(text.replace("pitch = { address = 3,", 'pitch = { driver = "manual",'))
    rig = load_rig(path)
    assert [rig.stages.driver_of(name) for name in ("lamp", "turn", "pitch")] == [
        "smc100",
        "kinesis",
        "manual",
    ]
    path.write_text(text.replace('serial = "27000001"', "address = 2"))
    with pytest.raises(InputError, match=r"stages.turn.serial is missing|unknown key stages.turn.address"):
        load_rig(path)
    path.write_text(text.replace('driver = "kinesis"', 'driver = "esp300"'))
    with pytest.raises(InputError, match=r"stages\.turn\.driver = 'esp300' needs a line of its own"):
        load_rig(path)

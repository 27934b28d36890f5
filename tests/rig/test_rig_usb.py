"""Spectrometers on USB, what is listed of a rig, and integration times joined."""

import gc
import importlib

import numpy as np
import pytest
from fake_instruments import seabreeze_sts
from rig_helpers import context, emulation, settings, with_spectrometer, write_plan

from clbrdf.cli import main
from clbrdf.rig import drivers
from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.emulator.spectrometer import EmulatedSpectrometer
from clbrdf.rig.errors import InstrumentError, UnpluggedError
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.row import RUNG
from clbrdf.scan import Scan

seabreeze = pytest.importorskip("seabreeze", reason="the extra seabreeze is not installed")


@pytest.fixture
def usb(monkeypatch):
    """Devices that seabreeze lists; its pure-Python backend."""
    from seabreeze import spectrometers

    devices = []
    monkeypatch.setattr(spectrometers, "list_devices", lambda: devices)
    monkeypatch.setattr(
        spectrometers.Spectrometer, "_backend", importlib.import_module("seabreeze.pyseabreeze")
    )
    return devices


USB = '[spectrometer]\ndriver = "seabreeze"\nshutter = "manual"\nserial = "S12345"\nshutter_time = 0\n'


def test_a_whole_scan_with_seabreeze(tmp_path, usb):
    """seabreeze's own protocol code against the emulated STS; a person at the shutter."""
    path = with_spectrometer(tmp_path, USB)
    with EmulatedRig(load_rig(path)) as emulated:
        sts = EmulatedSpectrometer(emulated.world)
        usb.append(seabreeze_sts(sts.answer))

        def ask(question):
            emulated.world.move_shutter(question.startswith("open"))
            return ""

        plan = write_plan(tmp_path, step=10.0, dark_every=1000)
        measure(plan, path, tmp_path / "scan.h5", budget=POINTS_ONLY, ask=ask)
    scan, raw = Scan.open(tmp_path / "scan.h5"), read_raw(tmp_path / "scan.h5")
    from test_rig_measure import model_values, quantisation_bound

    assert (np.abs(scan.brdf - model_values(scan)) <= quantisation_bound(raw, scan)).all()
    assert "STS S12345" in scan.provenance["instruments"]


def sts(usb, **keys):
    class World:
        settings = type("S", (), {"effects": type("E", (), {"nonlinearity": (1.0, 1e-6)})})
        is_open = False

        def move_shutter(self, is_open):
            self.is_open = is_open

    device = EmulatedSpectrometer(World())
    device._expose = lambda: np.arange(1024, dtype=np.uint16)
    usb.append(seabreeze_sts(device.answer))
    driver = drivers.get_driver("spectrometer", "seabreeze")
    return driver.connect(settings("seabreeze", "spectrometer", **keys), context())


def test_seabreeze_suite(usb):
    spectrometer = sts(usb, shutter="manual")
    spectrometer.open()
    assert spectrometer.identify() == "STS S12345"
    assert (spectrometer.full_scale, spectrometer.pixels) == (16383, 1024)
    assert (spectrometer.shortest, spectrometer.longest) == (10e-6, 85.0)
    assert spectrometer.get_wavelengths()[0] == pytest.approx(340.0)
    assert np.isnan(spectrometer.get_temperature())
    spectrometer.set_integration_time(0.01)
    assert spectrometer.measure_spectrum().tolist() == list(range(1024))
    with pytest.raises(InstrumentError, match="is outside"):
        spectrometer.set_integration_time(100.0)
    usb[0]._transport.is_lost = True
    with pytest.raises(UnpluggedError, match="plug it in again"):
        spectrometer.measure_spectrum()
    assert not spectrometer.is_open


def test_seabreeze_devices_that_cannot_be_used(usb, monkeypatch):
    nothing = drivers.get_driver("spectrometer", "seabreeze").connect(
        settings("seabreeze", "spectrometer", serial="X1"), context()
    )
    with pytest.raises(InstrumentError, match="no Ocean spectrometer with serial number X1 is connected"):
        nothing.open()
    spectrometer = sts(usb, shutter="strobe")
    sts(usb)
    with pytest.raises(InstrumentError, match=r"several spectrometers .*S12345.*; give spectrometer.serial"):
        spectrometer.open()
    del usb[1]
    spectrometer.open()
    with pytest.raises(InstrumentError, match="STS has no strobe output; give another"):
        spectrometer.set_shutter(True)
    spectrometer.close()
    for text, words in (
        ("[Errno 13] Access denied", "seabreeze_os_setup"),
        ("[Errno 16] Resource busy", "in use"),
    ):
        monkeypatch.setattr(
            type(usb[0]), "open", lambda self, text=text: (_ for _ in ()).throw(OSError(text))
        )
        with pytest.raises(InstrumentError, match=words):
            spectrometer.open()


# pyvisa-py leaves the sockets open that it looks for instruments with.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_devices_of_the_rig(capsys, monkeypatch, usb):
    monkeypatch.setenv("COLUMNS", "100")
    sts(usb)
    assert main(["devices", "--rig"]) == 0
    text = capsys.readouterr().out
    assert "S12345" in text
    assert max(map(len, text.splitlines())) <= 100
    for name in drivers.driver_names():
        assert name in text
    gc.collect()


def test_hdr_rungs_join(tmp_path):
    """Longer times for the dim wavelengths: less noise there, the same values, a check in the overlap."""
    noise = "shot_noise = true\nread_noise = 3.0"
    errors = {}
    for name, more in (("one", ""), ("hdr", "hdr = 2")):
        folder = tmp_path / name
        folder.mkdir()
        with emulation(folder, effects=noise, seed=4, emulator="lamp_temperature = 2000") as (rig_path, _, _):
            plan = write_plan(folder, step=20.0, more=more)
            plan.write_text(plan.read_text().replace("start = 500, stop = 600", "start = 400, stop = 760"))
            measure(plan, rig_path, folder / "scan.h5", budget=POINTS_ONLY)
        scan, raw = Scan.open(folder / "scan.h5"), read_raw(folder / "scan.h5")
        from test_rig_measure import model_values

        errors[name] = (
            (scan.brdf / model_values(scan) - 1.0)[:, :4],
            (scan.brdf - model_values(scan)) / scan.sigma,
        )
        assert (np.count_nonzero(raw.rows["kind"] == RUNG) > 8) == (name == "hdr")
        assert "rungs_disagree" not in scan.flag_counts()
    assert np.isnan(errors["one"][0]).any(), "where a single time sees no light at all"
    assert np.isfinite(errors["hdr"][0]).all()
    assert np.std(errors["hdr"][0]) < 0.5 * np.nanstd(errors["one"][0])
    assert np.std(errors["hdr"][1]) == pytest.approx(1.0, abs=0.25)


def test_rungs_that_disagree_are_flagged(tmp_path):
    """A detector whose long exposures lose 5 %."""
    with emulation(tmp_path) as (rig_path, _, emulated):
        counts = emulated.world.counts

        def tired(seconds, began):
            lossy = counts(seconds, began).astype(float) - 1500
            return np.rint(1500 + lossy * seconds**-0.05 * 0.6).astype(np.uint16)

        emulated.world.counts = tired
        plan = write_plan(tmp_path, step=30.0, more="hdr = 1")
        outcome = measure(plan, rig_path, tmp_path / "scan.h5", budget=POINTS_ONLY)
    assert outcome.flagged.get("rungs_disagree", 0) > 0

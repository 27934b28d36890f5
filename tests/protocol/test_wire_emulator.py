"""The same dialogues from the other side: literal bytes to the emulated instruments and back."""

import struct

import numpy as np
import pytest
from frames import request, response

from clbrdf.rig.emulator.powermeter import EmulatedPowerMeter
from clbrdf.rig.emulator.settings import EmulatorSettings, LeftSettings
from clbrdf.rig.emulator.spectrometer import EmulatedSpectrometer
from clbrdf.rig.emulator.stages import EmulatedStages
from clbrdf.rig.emulator.world import World
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.samples import sample_path


class Time:
    """A clock set by the test."""

    def __init__(self):
        self.seconds = 0.0

    def now(self):
        return self.seconds

    def sleep(self, seconds):
        self.seconds += seconds


@pytest.fixture
def clock():
    return Time()


@pytest.fixture
def world(clock):
    rig = load_rig(sample_path("rig.toml"))
    return World(rig, EmulatorSettings(), clock)


@pytest.fixture
def stages(world, clock):
    return EmulatedStages(world.rig.stages, clock, 0.0, 0)


def say(device, data):
    """Send bytes through the device's own framing and collect the reply."""
    buffer, reply = bytearray(data), b""
    while (message := device.take(buffer)) is not None:
        reply += device.answer(message)
    return reply


def test_not_referenced_until_homed(stages, clock):
    assert say(stages, b"1TS\r\n") == b"1TS00000A\r\n"
    assert say(stages, b"1TP\r\n") == b"1TP0\r\n"
    assert say(stages, b"1PA5\r\n1TE\r\n") == b"1TEH\r\n"
    assert say(stages, b"1OR\r\n1TE\r\n1TS\r\n") == b"1TE@\r\n1TS00001E\r\n"
    assert say(stages, b"1OR\r\n1TE\r\n") == b"1TEE\r\n"
    clock.seconds += 10.0
    assert say(stages, b"1TS\r\n1TP?\r\n") == b"1TS000032\r\n1TP0\r\n"


def home(stages, clock):
    say(stages, b"1OR\r\n2OR\r\n3OR\r\n")
    clock.seconds += 10.0


def test_move_takes_its_time(stages, clock):
    home(stages, clock)
    assert say(stages, b"1PT10\r\n") == b"1PT0.75\r\n"  # 10/20 + 20/80
    assert say(stages, b"1pa 10.5\r\n1TE\r\n1TS\r\n") == b"1TE@\r\n1TS000028\r\n"
    clock.seconds += 0.25  # end of the ramp: v²/2a = 2.5°
    assert say(stages, b"1TP\r\n") == b"1TP2.5\r\n"
    assert say(stages, b"1PA0\r\n1TE\r\n") == b"1TEM\r\n"
    clock.seconds += 10.0
    assert say(stages, b"1TS\r\n1TP\r\n") == b"1TS000033\r\n1TP10.5\r\n"
    say(stages, b"1PR-2\r\n")
    clock.seconds += 10.0
    assert say(stages, b"1TP\r\n") == b"1TP8.5\r\n"


def test_soft_limits_and_settings(stages, clock):
    home(stages, clock)
    assert say(stages, b"2SR25\r\n2SR?\r\n2PA26\r\n2TE\r\n2TE\r\n") == b"2SR25\r\n2TEN\r\n2TE@\r\n"
    assert say(stages, b"2VA10\r\n2VA?\r\n2AC?\r\n") == b"2VA10\r\n2AC80\r\n"
    assert say(stages, b"2PAx\r\n2TE\r\n") == b"2TEC\r\n"
    assert say(stages, b"2XX\r\n2TE\r\n") == b"2TEA\r\n"
    assert say(stages, b"9TP\r\n") == b""


def test_stop_enable_configuration_reset(stages, clock):
    home(stages, clock)
    say(stages, b"1PA90\r\n")
    clock.seconds += 1.0
    say(stages, b"ST\r\n")
    assert say(stages, b"1TS\r\n1TP\r\n") == b"1TS000033\r\n1TP17.5\r\n"
    assert say(stages, b"1MM0\r\n1TS\r\n1MM1\r\n1TS\r\n") == b"1TS00003C\r\n1TS000034\r\n"
    assert say(stages, b"1RS\r\n1TS\r\n1PW1\r\n1TS\r\n") == b"1TS00000A\r\n1TS000014\r\n"
    assert say(stages, b"1PW0\r\n1TS\r\n") == b"", "silent while it leaves configuration"
    clock.seconds += 5.0
    assert say(stages, b"1TS\r\n") == b"1TS00000A\r\n"
    assert say(stages, b"1VE\r\n1ID?\r\n") == b"1VE SMC_CC_2.0.1\r\n1IDMRS101\r\n"


def test_stall_stays_until_enabled(stages, clock):
    home(stages, clock)
    assert stages.happens("stall", b"1PA10\r\n")
    say(stages, b"1PA10\r\n")
    clock.seconds += 10.0
    assert say(stages, b"1TS\r\n1TP\r\n") == b"1TS00203D\r\n1TP5\r\n"
    clock.seconds += 100.0
    # The bits that TS reported are cleared by it; the state stays.
    assert say(stages, b"1TS\r\n1PA10\r\n1TE\r\n") == b"1TS00003D\r\n1TEJ\r\n"
    assert say(stages, b"1MM1\r\n1TS\r\n") == b"1TS000034\r\n"


@pytest.mark.parametrize(("target", "bit"), [(b"10", b"2"), (b"-10", b"1")])
def test_limit_switch(stages, clock, target, bit):
    home(stages, clock)
    assert stages.happens("limit_switch", b"1PA" + target + b"\r\n")
    say(stages, b"1PA" + target + b"\r\n")
    clock.seconds += 10.0
    assert say(stages, b"1TS\r\n") == b"1TS000" + bit + b"33\r\n"


def test_power_cut(stages, clock):
    home(stages, clock)
    assert stages.power_cut() == b"\0\0\0"
    assert say(stages, b"1TS\r\n") == b"1TS00000A\r\n"


def test_strict_stages(stages, clock):
    """What the manual does not allow leaves an error letter and no reply."""
    assert say(stages, b"1VA10\r\n1TE\r\n") == b"1TEH\r\n", "not while not referenced"
    home(stages, clock)
    assert say(stages, b"1PT0\r\n1TE\r\n") == b"1TEC\r\n", "PT wants more than 1e-6"
    assert say(stages, b"1PT0.000001\r\n1TE\r\n") == b"1TEC\r\n"
    assert say(stages, b"1SL5\r\n1TE\r\n1SR-5\r\n1TE\r\n") == b"1TEC\r\n1TEC\r\n"
    assert say(stages, b"1VA0\r\n1TE\r\n") == b"1TEC\r\n"
    assert say(stages, b"1PW1\r\n1TE\r\n1PW0\r\n1TE\r\n") == b"1TED\r\n1TED\r\n"


@pytest.fixture
def meter(world, clock):
    meter = EmulatedPowerMeter(world)
    clock.seconds += 1.0  # power-up is over
    return meter


def test_meter(meter, clock):
    assert say(meter, b"U?\n") == b"U?\n2\n", "echo on and dBm after power-on"
    assert say(meter, b"E0\n") == b"E0\n"
    assert say(meter, b"D?\n") == b"0E0\n", "1 mW is 0 dBm"
    assert say(meter, b"U1\nU?\nD?\n") == b"1\n1E-3\n"
    assert say(meter, b"W0550\nW?\n") == b"0550\n"
    assert say(meter, b"C\nQ?\n") == b"0\n", "no new reading yet"
    clock.seconds += 0.2
    assert say(meter, b"Q?\n") == b"128\n"
    assert say(meter, b"W55\nQ?\nC\nQ?\n") == b"129\n0\n"
    assert say(meter, b"#\nQ?\n") == b"2\n"
    assert say(meter, b"CS\nQ?\n") == b"2\n", "the clear command is C"
    meter.power_cut()
    assert say(meter, b"U?\n") == b"U?\n2\n"


def test_meter_states(meter, clock):
    say(meter, b"E0\nU1\nF3\n")
    assert say(meter, b"R0\nQ?\n") == b"32\n", "busy while it changes its range"
    clock.seconds += 1.0
    assert say(meter, b"Q?\nG0\nC\n") == b"128\n"
    clock.seconds += 5.0
    assert say(meter, b"Q?\n") == b"0\n", "in hold there are no new readings"
    meter.world.settings = meter.world.settings.model_copy(update={"reference_power": 5e-4})
    assert say(meter, b"F1\nG1\n") == b""
    clock.seconds += 0.45
    half = float(say(meter, b"D?\n"))
    assert 0.5e-3 < half < 1e-3, "a running average of 16 lags behind"
    assert say(meter, b"Z1\nF3\nD?\n") == b"0E0\n"


def test_meter_faults(world, clock):
    meter = EmulatedPowerMeter(world)
    say(meter, b"E0\nU1\nF3\n")
    clock.seconds += 1.0
    assert not meter.happens("front_panel", b"U?\n")
    assert meter.happens("front_panel", b"D?\n")
    assert say(meter, b"U?\n") == b"2\n"
    say(meter, b"U1\n")
    assert meter.happens("lamp_out", b"D?\n")
    readings = []
    for _ in range(14):
        clock.seconds += 0.11
        readings.append(say(meter, b"D?\n"))
    assert readings == [b"6.7E-4\n"] * 12 + [b"1E-3\n"] * 2


def test_spectrometer_identity(world):
    spectrometer = EmulatedSpectrometer(world)
    assert say(spectrometer, request(0x100, 7)) == response(0x100, 7, b"S12345")
    assert say(spectrometer, request(0x90, 8)) == response(0x90, 8, b"\x36\x00")
    assert say(spectrometer, request(0x80, 8)) == response(0x80, 8, b"\x03")
    assert say(spectrometer, request(0x180100, 9)) == response(0x180100, 9, b"\x04")
    assert say(spectrometer, request(0x180101, 9, b"\0")) == response(0x180101, 9, struct.pack("<f", 340.0))
    assert say(spectrometer, request(0x181100, 9)) == response(0x181100, 9, b"\x00")


def test_spectrometer_refuses(world):
    spectrometer = EmulatedSpectrometer(world)
    assert say(spectrometer, request(0xDEAD, 1)) == response(0xDEAD, 1, flags=9, error=2)
    assert say(spectrometer, request(0x110010, 1, b"\1")) == response(0x110010, 1, flags=9, error=5)
    short = struct.pack("<I", 9)
    assert say(spectrometer, request(0x110010, 2, short)) == response(0x110010, 2, flags=9, error=6)
    assert say(spectrometer, request(0x180101, 9, b"\4")) == response(0x180101, 9, flags=9, error=6)
    assert say(spectrometer, request(0x110110, 9, b"\7")) == response(0x110110, 9, flags=9, error=6)
    assert say(spectrometer, request(0x120010, 9, b"\1")) == response(0x120010, 9, flags=9, error=5)


def test_spectrometer_waits_for_a_trigger(world):
    spectrometer = EmulatedSpectrometer(world, LeftSettings(trigger_mode=2))
    assert say(spectrometer, request(0x101100, 1)) == b""


def test_spectrometer_settings(world, clock):
    spectrometer = EmulatedSpectrometer(world)
    time = struct.pack("<I", 100_000)
    assert say(spectrometer, request(0x110010, 1, time)) == b"", "silent unless an ACK is asked for"
    assert say(spectrometer, request(0x110010, 2, time, 4)) == response(0x110010, 2, flags=3)
    assert say(spectrometer, request(0x110110, 3, b"\2", 4)) == response(0x110110, 3, flags=3)
    assert say(spectrometer, request(0x110100, 4)) == response(0x110100, 4, b"\2")


def test_spectrum_and_the_stale_one_after_a_change(world, clock):
    spectrometer = EmulatedSpectrometer(world)
    say(spectrometer, request(0x110010, 1, struct.pack("<I", 1_000_000)))
    before = clock.seconds
    stale = say(spectrometer, request(0x101100, 2))
    assert clock.seconds - before == pytest.approx(0.01), "integrated with the old time"
    fresh = say(spectrometer, request(0x101100, 3))
    assert clock.seconds - before == pytest.approx(1.01)
    assert len(fresh) == 44 + 2048 + 20
    counts = np.frombuffer(fresh[44 : 44 + 2048], "<u2")
    assert (counts == 1520).all(), "bias 1500 and 20 dark counts a second, shutter closed"
    assert (np.frombuffer(stale[44 : 44 + 2048], "<u2") == 1500).all()


def test_reset_is_told_once(world):
    spectrometer = EmulatedSpectrometer(world)
    spectrometer.power_cut()
    assert say(spectrometer, request(0x100, 1)) == response(0x100, 1, flags=9, error=9)
    assert say(spectrometer, request(0x100, 2)) == response(0x100, 2, b"S12345")


def test_damaged_request_is_not_obeyed(world):
    spectrometer = EmulatedSpectrometer(world)
    broken = bytearray(request(0x100, 1))
    broken[12] ^= 4
    assert say(spectrometer, bytes(broken)) == b""
    assert say(spectrometer, b"xx" + request(0x100, 2)) == response(0x100, 2, b"S12345")

"""1830-C: literal bytes out and in, as in docs/protocols.md."""

import pytest
from wire import IMPATIENT, PATIENCE, Dialogue, kinds

from clbrdf.rig.drivers.newport1830c import Newport1830C
from clbrdf.rig.errors import InstrumentError, OutOfBandError

CONFIGURE = [
    *[
        (command + b"\n", b"")
        for command in (b"C", b"E0", b"G1", b"Z0", b"R0", b"F3", b"A0", b"U1", b"W0550")
    ],
    (b"Q?\n", b"0\n"),
    (b"Q?\n", b"0\n"),
    (b"W?\n", b"0550\n"),
    (b"U?\n", b"1\n"),
]
"""Echo off, running, no zero offset, automatic range, no average, attenuator off, watts."""


def reading(*powers, units=b"1", status=b"128"):
    """Each reading is a new one: cleared, then done, then asked for."""
    steps = [
        step
        for power in powers
        for step in ((b"C\n", b""), (b"Q?\n", status + b"\n"), (b"D?\n", power + b"\n"))
    ]
    return [*steps, (b"U?\n", units + b"\n")]


def configured(peer, noise=0.0, patience=PATIENCE):
    meter = Newport1830C(peer.line(patience))
    meter.configure(550.0, noise)
    return meter


def test_identify_switches_the_echo_off_first():
    with Dialogue((b"E0\n", b"E0\n"), (b"U?\n", b"2\n")) as peer:
        assert Newport1830C(peer.line()).identify() == "1830-C, units 2"


@pytest.mark.parametrize(
    ("text", "watts"), [(b"5E-9", 5e-9), (b"+.75E-9", 0.75e-9), (b"7.5123E-4", 7.5123e-4), (b"1.E-3", 1e-3)]
)
def test_formats_of_power(text, watts):
    with Dialogue(*CONFIGURE, *reading(text, text, text)) as peer:
        assert configured(peer).measure_power() == watts


def test_a_digit_lost_on_the_line_does_not_count():
    with Dialogue(*CONFIGURE, *reading(b"7.5123E-4", b"75123E-4", b"7.5123E-4")) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 7.5123e-4
        assert kinds(meter.line) == ["reading disagrees"]


def test_a_digit_lost_of_the_status_does_not_count():
    place = CONFIGURE.index((b"Q?\n", b"0\n"))
    torn = [*CONFIGURE[:place], (b"Q?\n", b"28\n"), (b"Q?\n", b"128\n")]
    with Dialogue(*torn, *CONFIGURE, *reading(b"1E-3", b"1E-3", b"1E-3")) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["reading disagrees"]


def test_noise_is_no_fault():
    with Dialogue(*CONFIGURE, *reading(b"1.001E-3", b"1E-3", b"9.99E-4")) as peer:
        meter = configured(peer, noise=0.001)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == []


def test_a_hand_on_the_front_panel():
    """Units changed between the readings: found afterwards, set again, measured again."""
    with Dialogue(
        *CONFIGURE, *reading(b"1E-3", b"0E+0", b"0E+0", units=b"2"), *CONFIGURE, *reading(*[b"1E-3"] * 3)
    ) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["units changed"]


@pytest.mark.parametrize("status", [b"132", b"136"])
def test_saturated_or_over_range(status):
    with Dialogue(*CONFIGURE, (b"C\n", b""), (b"Q?\n", status + b"\n")) as peer:
        meter = configured(peer)
        with pytest.raises(OutOfBandError, match="saturated"):
            meter.measure_power()


def test_busy_is_waited_for():
    """While it changes its range the meter has no new reading."""
    with Dialogue(
        *CONFIGURE,
        (b"C\n", b""),
        (b"Q?\n", b"32\n"),
        (b"Q?\n", b"160\n"),
        (b"Q?\n", b"128\n"),
        (b"D?\n", b"1E-3\n"),
        *reading(b"1E-3", b"1E-3"),
    ) as peer:
        assert configured(peer).measure_power() == 1e-3


def test_command_error_configures_again_and_repeats():
    with Dialogue(
        *CONFIGURE,
        (b"C\n", b""),
        (b"Q?\n", b"2\n"),
        (b"D?\n", b"1E-3\n"),
        *reading(b"1E-3", b"1E-3"),
        *CONFIGURE,
        *reading(*[b"2E-3"] * 3),
    ) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 2e-3
        assert kinds(meter.line) == ["command error"]


def test_settings_that_are_not_understood_are_made_again():
    damaged = [*CONFIGURE[:9], *[(b"Q?\n", b"1\n")] * 2]
    with Dialogue(*damaged, *CONFIGURE) as peer:
        assert kinds(configured(peer).line) == ["command error"]


def test_a_power_beyond_all_numbers_is_no_reading():
    with Dialogue(
        *CONFIGURE, *reading(b"9E+999", b"1E-3", b"1E-3"), *CONFIGURE, *reading(*[b"1E-3"] * 3)
    ) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["bad reply"]


def test_darkness_reads_a_little_below_zero():
    with Dialogue(*CONFIGURE, *reading(b"-3E-12", b"-1E-12", b"-2E-12")) as peer:
        assert configured(peer).measure_power() == 0.0


def test_late_reply_is_fenced_off():
    """The answer to D? comes after the deadline, before that to W?: it must not shift what follows."""
    with Dialogue(
        *CONFIGURE,
        (b"C\n", b""),
        (b"Q?\n", b"128\n"),
        (b"D?\n", b""),
        (b"W?\n", b"9E-9\n0550\n"),
        (b"D?\n", b"1E-3\n"),
        *reading(b"1E-3", b"1E-3"),
        *CONFIGURE,
        *reading(*[b"1E-3"] * 3),
    ) as peer:
        meter = configured(peer, patience=IMPATIENT)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["no reply"]


@pytest.mark.parametrize("bad", [b"1E-3x\n", b"\x001E-3\n", b"1.5\n", b"E-3\n"])
def test_bad_reading_is_repeated(bad):
    with Dialogue(
        *CONFIGURE,
        (b"C\n", b""),
        (b"Q?\n", b"128\n"),
        (b"D?\n", bad),
        (b"W?\n", b"0550\n"),
        (b"D?\n", b"1E-3\n"),
        *reading(b"1E-3", b"1E-3"),
        *CONFIGURE,
        *reading(*[b"1E-3"] * 3),
    ) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["bad reply"]


def test_wavelength_not_taken_is_set_again():
    wrong = [*CONFIGURE[:11], (b"W?\n", b"0633\n")]
    with Dialogue(*wrong, *CONFIGURE) as peer:
        assert kinds(configured(peer).line) == ["setting disagrees"]


def test_another_instrument_is_named():
    steps = [(b"E0\n", b""), *[(b"U?\n", b"1TS00000A\n"), (b"W?\n", b"0550\n")] * 3, (b"U?\n", b"no\n")]
    with Dialogue(*steps) as peer, pytest.raises(InstrumentError, match="no 1830-C answers"):
        Newport1830C(peer.line(IMPATIENT)).identify()

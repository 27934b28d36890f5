"""1830-C: literal bytes out and in, as in knowledge/rig.md."""

import pytest
from wire import IMPATIENT, PATIENCE, Dialogue, kinds

from clbrdf.rig.drivers.newport1830c import Newport1830C
from clbrdf.rig.errors import InstrumentError, OutOfBandError

CONFIGURE = [
    (b"CS\n", b""),
    (b"E0\n", b""),
    (b"A0\n", b""),
    (b"U1\n", b""),
    (b"W0550\n", b""),
    (b"W?\n", b"0550\n"),
    (b"U?\n", b"1\n"),
]


def reading(*powers, units=b"1", status=b"128"):
    return [
        (b"U1\n", b""),
        *[(b"D?\n", power + b"\n") for power in powers],
        (b"U?\n", units + b"\n"),
        (b"Q?\n", status + b"\n"),
    ]


def configured(peer, noise=0.0, patience=PATIENCE):
    meter = Newport1830C(peer.line(patience))
    meter.configure(550.0, noise)
    return meter


def test_identify_switches_the_echo_off_first():
    with Dialogue((b"E0\n", b"E0\n"), (b"U?\n", b"2\n")) as peer:
        assert Newport1830C(peer.line()).identify() == "2"


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
    with Dialogue(*CONFIGURE, *reading(*[b"1E-3"] * 3, status=status)) as peer:
        meter = configured(peer)
        with pytest.raises(OutOfBandError, match="saturated"):
            meter.measure_power()


def test_command_error_clears_the_status_and_repeats():
    with Dialogue(
        *CONFIGURE,
        *reading(*[b"1E-3"] * 3, status=b"130"),
        (b"CS\n", b""),
        *CONFIGURE,
        *reading(*[b"2E-3"] * 3),
    ) as peer:
        assert configured(peer).measure_power() == 2e-3


def test_late_reply_is_fenced_off():
    """The answer to D? comes after the deadline, before that to W?: it must not shift what follows."""
    with Dialogue(
        *CONFIGURE,
        (b"U1\n", b""),
        (b"D?\n", b""),
        (b"W?\n", b"9E-9\n0550\n"),
        *reading(*[b"1E-3"] * 3)[1:],
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
        (b"U1\n", b""),
        (b"D?\n", bad),
        (b"W?\n", b"0550\n"),
        *reading(*[b"1E-3"] * 3)[1:],
        *CONFIGURE,
        *reading(*[b"1E-3"] * 3),
    ) as peer:
        meter = configured(peer)
        assert meter.measure_power() == 1e-3
        assert kinds(meter.line) == ["bad reply"]


def test_wavelength_not_taken_is_set_again():
    wrong = [*CONFIGURE[:5], (b"W?\n", b"0633\n")]
    with Dialogue(*wrong, *CONFIGURE) as peer:
        assert kinds(configured(peer).line) == ["setting disagrees"]


def test_another_instrument_is_named():
    steps = [(b"E0\n", b""), *[(b"U?\n", b"1TS00000A\n"), (b"W?\n", b"0550\n")] * 3, (b"U?\n", b"no\n")]
    with Dialogue(*steps) as peer, pytest.raises(InstrumentError, match="no 1830-C answers"):
        Newport1830C(peer.line(IMPATIENT)).identify()

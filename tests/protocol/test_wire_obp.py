"""OBP: literal bytes out and in, as in docs/protocols.md."""

import struct

import numpy as np
import pytest
from frames import frame, request, response
from hypothesis import given
from hypothesis import strategies as st
from wire import IMPATIENT, Dialogue, kinds

from clbrdf.rig.drivers import _obp_message as obp
from clbrdf.rig.drivers.obp import ObpSpectrometer
from clbrdf.rig.errors import InstrumentError, NoReplyError, RefusedError

SPECTRUM = np.arange(1024, dtype="<u2").tobytes()
SET_TIME, RAW, LAMP = 0x00110010, 0x00101100, 0x00110410


TRIGGER, AVERAGE, BOXCAR = (0x110110, 0x110100), (0x120010, 0x120000), (0x121010, 0x121000)


def settings(first, microseconds, shutter=0):
    """State, shutter and time set after a fault or at the start, with their acknowledgements."""
    time = struct.pack("<I", microseconds)
    steps, k = [], first
    for (setter, getter), value in ((TRIGGER, b"\0"), (AVERAGE, b"\1\0"), (BOXCAR, b"\0")):
        steps += [
            (request(setter, k, value, 4), response(setter, k, flags=3)),
            (request(getter, k + 1), response(getter, k + 1, value)),
        ]
        k += 2
    return [
        *steps,
        (request(LAMP, k, bytes([shutter]), 4), response(LAMP, k, flags=3)),
        (request(SET_TIME, k + 1, time, 4), response(SET_TIME, k + 1, flags=3)),
    ]


def test_a_whole_frame_in_hexadecimal():
    """Get serial number, regarding 1, version 0x1100, MD5 taken with md5sum(1)."""
    header = bytes.fromhex(
        "c1c0 0011 0000 0000 00010000 01000000 000000000000 01 0000000000000000000000000000000000 14000000"
    )
    data = obp.Message(obp.GET_SERIAL_NUMBER, 1).encode()
    assert data[:44] == header
    assert data[44:60].hex() == "ab29d877ff68645634f85c6781dbc8e4"
    assert data[60:] == bytes.fromhex("c5c4c3c2")


def test_serial_number():
    with Dialogue((request(0x100, 1), response(0x100, 1, b"S12345\0\0"))) as peer:
        assert ObpSpectrometer(peer.line()).identify() == "S12345"


def test_coefficients():
    with Dialogue(
        (request(0x180100, 1), response(0x180100, 1, b"\x02")),
        (request(0x180101, 2, b"\x00"), response(0x180101, 2, struct.pack("<f", 340.5))),
        (request(0x180101, 3, b"\x01"), response(0x180101, 3, struct.pack("<f", 0.25))),
        (request(0x181100, 4), response(0x181100, 4, b"\x01")),
        (request(0x181101, 5, b"\x00"), response(0x181101, 5, struct.pack("<f", 1.0))),
    ) as peer:
        spectrometer = ObpSpectrometer(peer.line())
        assert spectrometer.get_wavelengths()[[0, 1, 1023]].tolist() == [340.5, 340.75, 596.25]
        assert spectrometer.get_nonlinearity_coefficients().tolist() == [1.0]


def test_first_spectrum_after_a_change_is_thrown_away():
    stale = bytes(2048)
    time = struct.pack("<I", 50_000)
    with Dialogue(
        (request(SET_TIME, 1, time, 4), response(SET_TIME, 1, flags=3)),
        *settings(2, 50_000),
        (request(RAW, 10), response(RAW, 10, stale)),
        (request(RAW, 11), response(RAW, 11, SPECTRUM)),
        (request(RAW, 12), response(RAW, 12, SPECTRUM)),
    ) as peer:
        spectrometer = ObpSpectrometer(peer.line())
        spectrometer.set_integration_time(0.05)
        assert spectrometer.measure_spectrum().tolist() == list(range(1024))
        spectrometer.set_integration_time(0.05)  # no change: nothing is sent
        assert spectrometer.measure_spectrum()[1023] == 1023


def test_a_state_that_is_not_taken_is_refused():
    steps = [
        (request(SET_TIME, 1, struct.pack("<I", 10), 4), response(SET_TIME, 1, flags=3)),
        (request(TRIGGER[0], 2, b"\0", 4), response(TRIGGER[0], 2, flags=3)),
        (request(TRIGGER[1], 3), response(TRIGGER[1], 3, b"\3")),
    ]
    with Dialogue(*steps) as peer:
        spectrometer = ObpSpectrometer(peer.line())
        spectrometer.set_integration_time(10e-6)
        with pytest.raises(RefusedError, match="trigger mode stays 03"):
            spectrometer.measure_spectrum()


def test_older_firmware_without_averaging_and_boxcar():
    """Error 2, unknown message type: there is nothing to set, and nothing is asked again."""
    unknown = {
        k: (request(kind, k, value, 4), response(kind, k, flags=9, error=2))
        for k, kind, value in ((4, AVERAGE[0], b"\1\0"), (5, BOXCAR[0], b"\0"))
    }
    steps = [
        (request(SET_TIME, 1, struct.pack("<I", 10), 4), response(SET_TIME, 1, flags=3)),
        (request(TRIGGER[0], 2, b"\0", 4), response(TRIGGER[0], 2, flags=3)),
        (request(TRIGGER[1], 3), response(TRIGGER[1], 3, b"\0")),
        unknown[4],
        unknown[5],
        (request(LAMP, 6, b"\0", 4), response(LAMP, 6, flags=3)),
        (request(SET_TIME, 7, struct.pack("<I", 10), 4), response(SET_TIME, 7, flags=3)),
        (request(RAW, 8), response(RAW, 8, SPECTRUM)),
        (request(RAW, 9), response(RAW, 9, SPECTRUM)),
        (request(0x400001, 10, b"\0"), response(0x400001, 10, flags=9, error=2)),
    ]
    with Dialogue(*steps) as peer:
        spectrometer = ObpSpectrometer(peer.line())
        spectrometer.set_integration_time(10e-6)
        assert spectrometer.measure_spectrum().sum() == 1023 * 512
        assert np.isnan(spectrometer.get_temperature())
        assert np.isnan(spectrometer.get_temperature())


def test_temperature():
    celsius = struct.pack("<f", 31.5)
    with Dialogue((request(0x400001, 1, b"\0"), response(0x400001, 1, celsius))) as peer:
        assert ObpSpectrometer(peer.line()).get_temperature() == 31.5


def test_shutter_is_the_lamp_enable_output():
    with Dialogue((request(LAMP, 1, b"\x01", 4), response(LAMP, 1, flags=3))) as peer:
        ObpSpectrometer(peer.line()).set_shutter(True)


def test_wrong_checksum_is_repeated():
    broken = bytearray(response(0x100, 1, b"S1"))
    broken[30] ^= 1
    with Dialogue((request(0x100, 1), bytes(broken)), (request(0x100, 2), response(0x100, 2, b"S2"))) as peer:
        line = peer.line()
        assert ObpSpectrometer(line).identify() == "S2"
        assert kinds(line)[-1] == "bad reply"


def test_garbage_before_a_reply_is_skipped():
    with Dialogue((request(0x100, 1), b"\xc1\xc0garbage" + response(0x100, 1, b"S1"))) as peer:
        line = peer.line()
        assert ObpSpectrometer(line).identify() == "S1"
        assert kinds(line) == ["garbage"]


def test_reply_to_an_older_request_is_dropped():
    with Dialogue((request(0x100, 1), response(0x100, 77, b"OLD") + response(0x100, 1, b"NEW"))) as peer:
        line = peer.line()
        assert ObpSpectrometer(line).identify() == "NEW"
        assert kinds(line) == ["stale reply"]


def test_nack_with_an_error_is_refused():
    with (
        Dialogue((request(0x100, 1), response(0x100, 1, flags=9, error=12))) as peer,
        pytest.raises(RefusedError, match="no information"),
    ):
        ObpSpectrometer(peer.line()).identify()


def test_reset_is_told():
    with (
        Dialogue((request(0x100, 1), response(0x100, 1, flags=9, error=9))) as peer,
        pytest.raises(RefusedError, match="has been reset"),
    ):
        ObpSpectrometer(peer.line()).identify()


def test_lost_bytes_end_in_an_error_that_names_the_instrument():
    steps = [(request(0x100, k), response(0x100, k, b"S1")[:-1]) for k in range(1, 5)]
    with Dialogue(*steps) as peer, pytest.raises(InstrumentError, match="no OBP spectrometer answers"):
        ObpSpectrometer(peer.line(IMPATIENT)).identify()


def test_no_spectrum_in_time():
    steps = [
        (request(SET_TIME, 1, struct.pack("<I", 10), 4), response(SET_TIME, 1, flags=3)),
        *settings(2, 10),
        *[(request(RAW, k), b"") for k in range(10, 14)],
    ]
    with Dialogue(*steps) as peer:
        spectrometer = ObpSpectrometer(peer.line(IMPATIENT))
        spectrometer.set_integration_time(10e-6)
        with pytest.raises(NoReplyError, match="no reply"):
            spectrometer.measure_spectrum()


@pytest.mark.parametrize("seconds", [9e-6, 86.0, 0.0])
def test_integration_time_outside_the_instrument(seconds):
    with Dialogue() as peer, pytest.raises(InstrumentError, match="10 µs to 85 s"):
        ObpSpectrometer(peer.line()).set_integration_time(seconds)


messages = st.builds(
    dict,
    kind=st.integers(0, 2**32 - 1),
    regarding=st.integers(0, 2**32 - 1),
    data=st.binary(max_size=300),
    flags=st.integers(0, 63),
    error=st.integers(0, 255),
)


@given(messages)
def test_codec_agrees_with_the_table(fields):
    written = frame(
        fields["kind"], fields["regarding"], fields["data"], flags=fields["flags"], error=fields["error"]
    )
    assert obp.Message(**fields).encode() == written
    found = obp.find_message(written)
    assert found.message == obp.Message(**fields)
    assert found.used == len(written)


@given(messages, st.binary(max_size=60), st.data())
def test_a_damaged_message_is_never_taken(fields, noise, data):
    """Any single byte changed: either nothing is found, or nothing but a message with the same content."""
    written = bytearray(obp.Message(**fields).encode())
    place = data.draw(st.integers(0, len(written) - 1))
    written[place] ^= data.draw(st.integers(1, 255))
    found = obp.find_message(noise + bytes(written))
    if found.message is not None:
        # Only a checksum type turned to "none" or an ignored byte can pass.
        assert place in (22, *range(16, 22))


@given(messages, messages, st.binary(max_size=60).filter(lambda noise: b"\xc1" not in noise))
def test_resynchronises_after_garbage(first, second, noise):
    both = noise + obp.Message(**first).encode() + noise + obp.Message(**second).encode()
    found = obp.find_message(both)
    assert found.message == obp.Message(**first)
    assert obp.find_message(both[found.used :]).message == obp.Message(**second)

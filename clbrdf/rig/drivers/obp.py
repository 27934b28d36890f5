"""Ocean STS / Ventana spectrometers over RS-232, Ocean Binary Protocol.

Every message carries an MD5 checksum and a number that the reply repeats (`regarding`), so that a stale
reply is known as one. The instrument keeps trigger mode, averaging and boxcar of its last user, so they
are set and read back. The shutter of the lamp hangs on the spectrometer's lamp-enable output.

Source: Ocean Optics, STS Data Sheet, "Ocean Binary Protocol", and the message types of SeaBreeze's
OBPMessageTypes.h; every message sent is listed in docs/protocols.md.
"""

from __future__ import annotations

import struct
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.rig.connection import Context, SerialConnection
from clbrdf.rig.drivers import _obp_message as obp
from clbrdf.rig.errors import BadReplyError, InstrumentError, LineError, NoReplyError, RefusedError
from clbrdf.rig.roles import Counts
from clbrdf.rig.transport import SerialLine, make_line, repeated, why_silent

ROLES = ("spectrometer",)
MOST_SPECTRA = 10

STATE = (
    ("trigger mode", obp.SET_TRIGGER_MODE, obp.GET_TRIGGER_MODE, b"\0"),
    ("scans to average", obp.SET_SCANS_TO_AVERAGE, obp.GET_SCANS_TO_AVERAGE, b"\1\0"),
    ("boxcar width", obp.SET_BOXCAR_WIDTH, obp.GET_BOXCAR_WIDTH, b"\0"),
)
"""What to set and ask for: on demand, one scan (ours are summed here, in 32 bits), no smoothing."""


class Connection(SerialConnection):
    """Its serial port: 9600 baud unless set otherwise in the instrument."""

    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600


class UnknownTypeError(RefusedError):
    """The instrument's firmware does not know the message."""


class ObpSpectrometer:
    """An STS: 1024 pixels, full scale 16383, integration from 10 µs to 85 s."""

    full_scale = 16383
    pixels = 1024
    shortest = 10e-6
    longest = 85.0
    is_discrete = False

    def __init__(self, line: SerialLine) -> None:
        self.line = line
        self._regarding = 0
        self._buffer = bytearray()
        self._time: float | None = None
        self._time_before: float = 0.0
        self._is_stale = True
        self._shutter = False
        self._faults = -1
        self._has_temperature = True
        self._known: set[str] = {what for what, *_ in STATE}

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the port was lost."""
        return self.line.is_open

    def open(self) -> None:
        """Open the port and drain it."""
        self.line.open()
        self.line.drain()

    def close(self) -> None:
        """Close the port."""
        self.line.close()

    def identify(self) -> str:
        """Get the serial number.

        Raises
        ------
        InstrumentError
            What answers does not speak OBP.
        """
        self._buffer.clear()
        try:
            self.line.drain()
            return self._ask(obp.GET_SERIAL_NUMBER, "serial number").rstrip(b"\0").decode("ascii", "replace")
        except LineError as error:
            raise InstrumentError(why_silent(self.line, error, "OBP spectrometer")) from error

    def get_wavelengths(self) -> npt.NDArray[np.float64]:
        """Get the wavelength of each pixel, (1024,), nm, from the polynomial in the instrument."""
        coefficients = self._coefficients(
            obp.GET_WAVELENGTH_COEFFICIENT_COUNT, obp.GET_WAVELENGTH_COEFFICIENT
        )
        if not len(coefficients):
            raise RefusedError(f"{self.line.name}: no wavelength coefficients are stored in the spectrometer")
        pixel = np.arange(self.pixels, dtype=np.float64)
        return np.asarray(np.polynomial.polynomial.polyval(pixel, coefficients), dtype=np.float64)

    def get_temperature(self) -> float:
        """Measure the detector's temperature in °C; NaN where the firmware does not tell."""
        if self._has_temperature:
            try:
                data = self._ask(obp.GET_TEMPERATURE, "temperature", b"\0")
            except UnknownTypeError:
                self._has_temperature = False
            else:
                return float(struct.unpack("<f", data)[0]) if len(data) == 4 else float("nan")
        return float("nan")

    def get_nonlinearity_coefficients(self) -> npt.NDArray[np.float64]:
        """Get the polynomial in net counts to divide them by, lowest power first; empty if linear."""
        return self._coefficients(obp.GET_NONLINEARITY_COEFFICIENT_COUNT, obp.GET_NONLINEARITY_COEFFICIENT)

    def set_integration_time(self, seconds: float) -> None:
        """Set the integration time in s, 10 µs to 85 s, in whole µs."""
        if not self.shortest <= seconds <= self.longest:
            raise InstrumentError(f"{self.line.name}: {seconds:g} s is outside 10 µs to 85 s of integration")
        if seconds != self._time:
            self._time_before = max(self._time or 0.0, seconds)
            self._time, self._is_stale = seconds, True
            self._set_time()

    def set_shutter(self, is_open: bool) -> None:
        """Set the shutter of the lamp: lamp-enable on (open) or off (closed)."""
        if is_open != self._shutter or self._faults != self.line.faults:
            # A spectrum that is being integrated now began with the shutter as it was.
            self._shutter, self._is_stale = is_open, True
            self._set_shutter()

    def measure_spectrum(self) -> Counts:
        """Measure raw counts, (1024,), 0 to 16383.

        The first spectrum after any change of integration time is thrown away: it was integrated with
        the old one. After any fault on the line the instrument may have been reset unseen, so its
        settings are made again and the spectrum is repeated.

        Raises
        ------
        LineError
            No valid spectrum in several tries.
        RefusedError
            The instrument reports an error, a reset among them.
        """
        assert self._time is not None, "set_integration_time comes first"
        for _ in range(MOST_SPECTRA):
            if self._faults != self.line.faults:
                self._faults = self.line.faults
                self._set_state()
                self._set_shutter()
                self._set_time()
                self._is_stale = True
            if self._is_stale:
                self._spectrum()
                self._is_stale = False
                self._time_before = self._time
            counts = self._spectrum()
            if self._faults == self.line.faults:
                return counts
        raise NoReplyError(
            f"{self.line.name}: no spectrum without a fault on the line in {MOST_SPECTRA} tries"
        )

    def forget(self) -> None:
        """Forget what is known of the instrument: it was unplugged or reset."""
        self._time, self._is_stale, self._shutter, self._faults = None, True, False, -1
        self._buffer.clear()

    def _set_state(self) -> None:
        """Set trigger mode, averaging and boxcar, and read them back; older firmware lacks the latter two."""
        for what, setter, getter, value in STATE:
            if what not in self._known:
                continue
            try:
                self._ask(setter, what, value, obp.ACK_REQUESTED)
                found = self._ask(getter, what)
            except UnknownTypeError:
                self._known.discard(what)
                self.line.log.add(self.line.name, "not known to the instrument", what)
                continue
            if int.from_bytes(found, "little") != int.from_bytes(value, "little"):
                raise RefusedError(f"{self.line.name}: {what} stays {found.hex()}, not {value.hex()}")

    def _set_time(self) -> None:
        data = struct.pack("<I", round((self._time or 0.0) * 1e6))
        self._ask(obp.SET_INTEGRATION_TIME, "integration time", data, obp.ACK_REQUESTED)

    def _set_shutter(self) -> None:
        self._ask(obp.SET_LAMP_ENABLE, "lamp enable", bytes([self._shutter]), obp.ACK_REQUESTED)

    def _spectrum(self) -> Counts:
        time = max(self._time or 0.0, self._time_before)
        data = self._ask(obp.GET_RAW_SPECTRUM, "spectrum", reply=2 * self.pixels, device_time=time)
        counts = np.frombuffer(data, dtype="<u2")
        if counts.shape != (self.pixels,) or counts.max() > self.full_scale:
            raise RefusedError(
                f"{self.line.name}: a spectrum of {counts.size} pixels up to {counts.max(initial=0)}"
            )
        return counts.astype(np.uint32)

    def _coefficients(self, count_kind: int, kind: int) -> npt.NDArray[np.float64]:
        count = self._ask(count_kind, "coefficient count")
        if len(count) != 1:
            raise RefusedError(f"{self.line.name}: coefficient count of {len(count)} bytes")
        values = []
        for k in range(count[0]):
            data = self._ask(kind, f"coefficient {k}", bytes([k]))
            if len(data) != 4:
                raise RefusedError(f"{self.line.name}: coefficient {k} of {len(data)} bytes")
            values.append(struct.unpack("<f", data)[0])
        return np.array(values, dtype=np.float64)

    def _ask(
        self,
        kind: int,
        what: str,
        data: bytes = b"",
        flags: int = 0,
        reply: int = 16,
        device_time: float = 0.0,
    ) -> bytes:
        """Send a request and return the data of its reply; every request of ours may be repeated."""

        def exchange() -> bytes:
            self._regarding = self._regarding % 0xFFFFFFFF + 1
            request = obp.Message(kind, self._regarding, data, flags).encode()
            if self._buffer:
                self.line.fault("stale bytes", f"{len(self._buffer)} bytes thrown away before a request")
                self._buffer.clear()
            self.line.send(request)
            answer = self._read(kind, self.line.deadline(2 * len(request) + reply, device_time))
            return answer.data

        def resynchronise() -> None:
            self._buffer.clear()
            self.line.drain()

        return repeated(self.line, what, exchange, resynchronise)

    def _read(self, kind: int, deadline: float) -> obp.Message:
        """Read messages until the one that answers this request; older ones are logged and dropped."""
        while True:
            found = obp.find_message(self._buffer)
            del self._buffer[: found.used]
            if found.garbage:
                self.line.fault("garbage", f"{len(found.garbage)} bytes skipped: {found.garbage[:20]!r}")
            if found.bad_checksum is not None:
                raise BadReplyError(f"{self.line.name}: MD5 of a reply does not match")
            if found.message is None:
                self._fill(deadline)
            elif found.message.regarding != self._regarding or found.message.kind != kind:
                self.line.fault("stale reply", f"regarding {found.message.regarding}, not {self._regarding}")
            else:
                return self._checked(found.message)

    def _fill(self, deadline: float) -> None:
        try:
            self._buffer += self.line.receive(deadline)
        except NoReplyError as error:
            if not self._buffer:
                raise
            raise NoReplyError(f"{self.line.name}: short reply of {len(self._buffer)} bytes") from error

    def _checked(self, message: obp.Message) -> obp.Message:
        if message.error == obp.ERROR_RESET:
            self.line.fault("reset", "the spectrometer has been reset")
            raise RefusedError(f"{self.line.name}: the spectrometer has been reset")
        if message.error in (3, 1, 4, 5):  # the request was damaged on its way: as good as unheard
            raise BadReplyError(f"{self.line.name}: request refused, error {obp.ERRORS[message.error]}")
        if message.error == obp.ERROR_TYPE:
            raise UnknownTypeError(f"{self.line.name}: the instrument does not know {message.kind:#010x}")
        if message.error or message.flags & (obp.NACK | obp.HARDWARE_EXCEPTION):
            text = obp.ERRORS.get(message.error, f"code {message.error}")
            raise RefusedError(f"{self.line.name}: the spectrometer reports an error: {text}")
        return message


def connect(settings: Connection, context: Context) -> ObpSpectrometer:
    """Return the spectrometer of a rig file."""
    return ObpSpectrometer(make_line(settings, context))

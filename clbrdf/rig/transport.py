"""One serial line: deadlines from bits per second, exact reads, and what to do when an exchange fails.

Every read has a deadline: the time the bits take at the line's speed, the time the instrument needs, and
a margin for the operating system. A short read is an error, never a value. What arrives unasked is
stale and is thrown away before the next request. pyserial raises SerialException or a plain OSError
when a cable is pulled (on a pseudo-terminal mostly the latter): both mean that the port has to be
opened again and that nothing about the instrument is known.

No flow control is set on any line: the longest request is 70 bytes, XON/XOFF would strip 0x11 and 0x13
from binary data, and one stray 0x13 of line noise would silence the line for good.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from clbrdf.rig.connection import Context, SerialConnection
from clbrdf.rig.errors import BadReplyError, InstrumentError, LineError, NoReplyError, UnpluggedError
from clbrdf.rig.eventlog import EventLog

if TYPE_CHECKING:
    import serial

T = TypeVar("T")

BITS_PER_BYTE = 10
"""8N1: a start bit, eight data bits, a stop bit."""

POLL = 0.02
"""Longest single wait inside a read, s; deadlines are kept to this."""

QUIET = 0.01
"""A line counts as quiet when nothing has arrived for this long, s, or for ten bytes' time."""

TRIES = 4
"""How often an exchange that may be repeated is tried."""


class SerialLine:
    """A serial port, 8N1 without flow control.

    Attributes
    ----------
    name, port : str
        What is connected there, for messages, and the device path.
    baud : int
        Bits per second.
    patience : float
        Margin on every deadline, s.
    reply_time : float
        Longest time the instrument takes to begin a reply, s.
    faults : int
        Exchanges that went wrong so far: an instrument whose count rose is configured afresh.

    Raises
    ------
    UnpluggedError
        By every method: the port is gone.
    """

    def __init__(
        self, name: str, port: str, baud: int, patience: float, reply_time: float, log: EventLog
    ) -> None:
        self.name = name
        self.port = port
        self.baud = baud
        self.patience = patience
        self.reply_time = reply_time
        self.log = log
        self.faults = 0
        self._serial: serial.Serial | None = None
        self._buffer = bytearray()

    def open(self) -> None:
        """Open the port for this process alone.

        Raises
        ------
        InstrumentError
            No such port, not a serial port, no permission, or in use by another program.
        """
        import serial

        self.close()
        try:
            self._serial = serial.Serial(
                self.port, self.baud, timeout=POLL, write_timeout=1.0 + self.patience, exclusive=True
            )
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise InstrumentError(f"{self.name}: {self._why_closed(error)}") from error

    def _why_closed(self, error: Exception) -> str:
        text = str(error)
        if "exclusively lock" in text or "busy" in text:
            return f"port {self.port} is in use by another program; close that one"
        if not Path(self.port).exists():
            return f"no port {self.port}; check the cable and the port in the rig file"
        if "Permission" in text or "Errno 13" in text:
            return f"port {self.port} may not be opened; join the group that owns it (often dialout)"
        return f"port {self.port} is no serial port that can be used ({text.splitlines()[0]})"

    def close(self) -> None:
        """Close the port, whatever its state."""
        if self._serial is not None:
            with suppress(OSError):
                self._serial.close()
        self._serial = None
        self._buffer.clear()

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the port was lost."""
        return self._serial is not None

    def wire_time(self, count: int) -> float:
        """Seconds that `count` bytes take on the line."""
        return count * BITS_PER_BYTE / self.baud

    def deadline(self, count: int, device_time: float = 0.0) -> float:
        """Monotonic time by which `count` bytes, out and in, and the instrument's work are over.

        `device_time` is what the request takes beyond the usual reply time, s.
        """
        return time.monotonic() + self.wire_time(count) + self.reply_time + device_time + self.patience

    def send(self, request: bytes) -> None:
        """Throw away what arrived unasked, then write a request."""
        stale = self._receive_now()
        if stale or self._buffer:
            self.fault(
                "stale bytes", f"thrown away before a request: {bytes(self._buffer[:40] + stale[:40])!r}"
            )
            self.drain()
        try:
            self._require().write(request)
        except OSError as error:
            raise self._unplugged(error) from error

    def receive(self, deadline: float) -> bytes:
        """Return what has arrived, at least one byte.

        Raises
        ------
        NoReplyError
            Nothing came before the deadline.
        """
        while True:
            data = self._receive_now(wait=True)
            if data:
                return data
            if time.monotonic() > deadline:
                raise NoReplyError(f"{self.name}: no reply on {self.port} before the deadline")

    def read_until(self, end: bytes, deadline: float, most: int = 256) -> bytes:
        """Return the bytes up to and without `end`.

        Raises
        ------
        NoReplyError
            `end` did not come before the deadline.
        BadReplyError
            More than `most` bytes came without it.
        """
        while (place := self._buffer.find(end)) < 0:
            if len(self._buffer) > most:
                raise BadReplyError(
                    f"{self.name}: {len(self._buffer)} bytes on {self.port} without an end of line"
                )
            try:
                self._buffer += self.receive(deadline)
            except NoReplyError as error:
                if not self._buffer:
                    raise
                raise NoReplyError(
                    f"{self.name}: short reply {bytes(self._buffer[:40])!r} on {self.port}"
                ) from error
        found = bytes(self._buffer[:place])
        del self._buffer[: place + len(end)]
        return found

    def late_reply(self, longest: float = 2.0) -> float | None:
        """Listen after a missed deadline; return the seconds until something came, None if nothing did."""
        began = time.monotonic()
        try:
            self._buffer += self.receive(began + longest)
        except NoReplyError:
            return None
        return time.monotonic() - began

    def drain(self, longest: float = 0.0) -> bytes:
        """Read until the line is quiet, for `longest` seconds if given; return what was thrown away."""
        gone = bytes(self._buffer)
        self._buffer.clear()
        quiet = max(QUIET, self.wire_time(10), longest)
        end = time.monotonic() + quiet
        latest = (
            time.monotonic() + 1.0 + self.patience
        )  # a line that babbles for ever is reported by the next read
        while (now := time.monotonic()) < end and now < latest:
            data = self._receive_now()
            if data:
                gone += data
                end = now + quiet
            else:
                time.sleep(quiet / 10.0)
        return gone

    def fault(self, kind: str, text: str) -> None:
        """Log a fault of this line and count it."""
        self.faults += 1
        self.log.add(self.name, kind, text)

    def _receive_now(self, wait: bool = False) -> bytes:
        port = self._require()
        try:
            waiting = port.in_waiting
            return bytes(port.read(waiting or 1)) if waiting or wait else b""
        except OSError as error:
            raise self._unplugged(error) from error

    def _require(self) -> serial.Serial:
        if self._serial is None:
            raise UnpluggedError(f"{self.name}: port {self.port} is closed")
        return self._serial

    def _unplugged(self, error: OSError) -> UnpluggedError:
        self.close()
        return UnpluggedError(f"{self.name}: lost {self.port} ({error}); plug it in again")


def repeated(line: SerialLine, what: str, exchange: Callable[[], T], resynchronise: Callable[[], None]) -> T:
    """Do an exchange that may be repeated: queries, absolute moves, unit setting; never PR or OR.

    Raises
    ------
    LineError
        It failed `TRIES` times; the last failure.
    """
    for attempt in range(1, TRIES + 1):
        try:
            return exchange()
        except LineError as error:
            line.fault(_kind(error), f"{what}: {error} (try {attempt} of {TRIES})")
            if attempt == TRIES:
                raise
            with suppress(LineError):
                resynchronise()
    raise AssertionError("unreachable")


def _kind(error: LineError) -> str:
    return "no reply" if isinstance(error, NoReplyError) else "bad reply"


def why_silent(line: SerialLine, error: LineError, what: str) -> str:
    """Return in words why an instrument could not be identified, and the mend.

    An instrument that answers after the deadline needs a longer `reply_time`, not another port.
    """
    late = line.late_reply() if isinstance(error, NoReplyError) and line.is_open else None
    if late is not None:
        line.drain()
        needed = line.reply_time + line.patience + late
        return (
            f"{line.name}: {what} answers later than reply_time allows;"
            f" set reply_time = {2.0 * needed:.2g} in the rig file"
        )
    return (
        f"{line.name}: no {what} answers on {line.port}; check the port, the baud rate and the instrument"
        f" ({'nothing came back' if isinstance(error, NoReplyError) else error})"
    )


def make_line(connection: SerialConnection, context: Context) -> SerialLine:
    """Return the line of a serial connection, not yet open."""
    return SerialLine(
        context.name,
        connection.port,
        connection.baud,
        connection.patience,
        connection.reply_time,
        context.log,
    )

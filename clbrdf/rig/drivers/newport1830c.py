"""Newport 1830-C optical power meter: ASCII, LF, replies within 500 ms.

The meter keeps whatever state its last user left it in, so all of it is set: no echo, running, no zero
offset, automatic range, no averaging, attenuator off, watts. Replies carry neither address nor command:
after any fault the line is drained and a question with a known answer (`W?`) is asked until that answer
comes; everything older is stale. A reading has no checksum, so the median of three is taken, each of them
a new one: `C` clears the status byte, and the meter sets its bit "read done" when the next reading is
there. A hand on the front panel can change the units, so they are asked for after the readings.

Source: Newport, Model 1830-C Instruction Manual, chapter 5 and appendix A; every command sent is listed
in docs/protocols.md.
"""

from __future__ import annotations

import math
import re
import time
from statistics import median
from typing import Annotated

from pydantic import Field

from clbrdf.rig.connection import Context, SerialConnection
from clbrdf.rig.errors import BadReplyError, InstrumentError, LineError, NoReplyError, OutOfBandError
from clbrdf.rig.transport import SerialLine, make_line, repeated, why_silent

ROLES = ("reference",)
END = b"\n"
MOST_BYTES = 32

POWER = r"[+-]?(?:\d+\.?\d*|\.\d+)E[+-]?\d+"
WATTS = "1"
STATE = ("E0", "G1", "Z0", "R0", "F3", "A0", "U1")
"""No echo, running, zero off, automatic range, filter "fast" (no average), attenuator off, watts."""

PARAMETER_ERROR, COMMAND_ERROR, SATURATED, OVER_RANGE, BUSY, READ_DONE = 1, 2, 4, 8, 32, 128
LATCHED = PARAMETER_ERROR | COMMAND_ERROR | SATURATED | OVER_RANGE
READING_TIME = 3.0
"""Longest time to a new reading, automatic ranging included, s."""

ECHO_TIME = 0.1
"""How long the echo of a command may be under way, s."""

OUTLIER = 6.0
"""Readings that differ from their median by more than this many times their noise are logged."""


class Connection(SerialConnection):
    """Its serial port; the manual allows 500 ms for a reply."""

    reply_time: Annotated[float, Field(gt=0.0, le=60.0)] = 0.5


class Newport1830C:
    """The power meter that watches the lamp."""

    def __init__(self, line: SerialLine) -> None:
        self.line = line
        self._wavelength = ""
        self._noise = 0.0
        self._faults = -1

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the port was lost."""
        return self.line.is_open

    def open(self) -> None:
        """Open the port and drain it."""
        self.line.open()
        self.line.drain()
        self._faults = -1

    def close(self) -> None:
        """Close the port."""
        self.line.close()

    def identify(self) -> str:
        """Get the units in use, "1" to "4" for W, dBm, dB, REL; the echo is switched off first.

        Raises
        ------
        InstrumentError
            What answers is no 1830-C.
        """
        try:
            self.line.drain()
            self._tell("E0")
            self.line.drain(ECHO_TIME)  # the echo of E0 itself
            return f"1830-C, units {self._ask('U?', r'[1-4]')}"
        except LineError as error:
            raise InstrumentError(why_silent(self.line, error, "1830-C")) from error

    def configure(self, wavelength: float, noise: float) -> None:
        """Set its whole state and the wavelength in nm, whole numbers.

        `noise`, the relative standard deviation of one reading, tells which readings are outliers.
        """
        self._wavelength = f"{round(wavelength):04d}"
        self._noise = noise
        self._configure()

    def measure_power(self) -> float:
        """Measure the power in W, finite and at least 0: the median of three new readings.

        Raises
        ------
        OutOfBandError
            The detector is saturated or over range, or the units cannot be kept at watts.
        LineError
            No valid reading in several tries.
        """
        for _ in range(4):
            if self._faults != self.line.faults:
                self._configure()
            faults = self.line.faults
            readings = [self._new_reading() for _ in range(3)]
            units = self._ask("U?", r"[1-4]")
            if units != WATTS:
                self.line.fault("units changed", f"units are {units}, not {WATTS} (W); set again")
            elif self.line.faults == faults and median(readings) < 0.0:
                # Darkness reads a little below zero; the caller knows how much light there has to be.
                return 0.0
            elif self.line.faults == faults:
                self._log_outliers(readings)
                return median(readings)
        raise OutOfBandError(f"{self.line.name}: no steady reading of the reference power in four tries")

    def _new_reading(self) -> float:
        """Return a reading begun after this call: clear the status byte, wait for "read done", ask."""
        self._tell("C")
        deadline = time.monotonic() + READING_TIME + self.line.patience
        latched = 0
        while not (status := self._status()) & READ_DONE or status & BUSY:
            latched |= status & LATCHED
            if status & (PARAMETER_ERROR | COMMAND_ERROR):
                self.line.fault("command error", f"status {status}")
                break
            if time.monotonic() > deadline:
                self.line.fault("no new reading", f"none in {READING_TIME:g} s (status {status})")
                break
        if latched & ~status:
            # Only `C` takes these bits away: a digit was lost on the line.
            self.line.fault("reading disagrees", f"status bits {latched & ~status} came and went")
        if status & (SATURATED | OVER_RANGE):
            raise OutOfBandError(
                f"{self.line.name}: the reference detector is saturated or over its range"
                f" (status {status}); put a filter or its attenuator in front of it"
            )
        value = float(self._ask("D?", POWER))
        if not math.isfinite(value):
            self.line.fault("bad reply", f"a power of {value}")
            return 0.0
        return value

    def _status(self) -> int:
        status = int(self._ask("Q?", r"\d{1,3}"))
        if status > 255:
            raise BadReplyError(f"{self.line.name}: a status byte of {status}")
        return status

    def _log_outliers(self, readings: list[float]) -> None:
        middle = median(readings)
        if any(abs(value - middle) > OUTLIER * self._noise * middle for value in readings):
            self.line.fault("reading disagrees", f"{readings} W; the median is used")

    def _configure(self) -> None:
        """Set everything again: after a fault the meter may have been switched off and on.

        Raises
        ------
        NoReplyError
            It does not keep its settings.
        """
        for _ in range(4):
            faults = self.line.faults
            self._tell("C")
            for command in (*STATE, f"W{self._wavelength}"):
                self._tell(command)
            self.line.drain(ECHO_TIME)
            status = self._status()
            gone = status & ~self._status() & (LATCHED | READ_DONE)
            if status & (PARAMETER_ERROR | COMMAND_ERROR):
                self.line.fault("command error", f"status {status} after its settings")
            elif gone:
                self.line.fault("reading disagrees", f"status bits {gone} came and went")
            elif self._ask("W?", r"\d{4}") != self._wavelength or self._ask("U?", r"[1-4]") != WATTS:
                self.line.fault("setting disagrees", "wavelength or units; set again")
            if self.line.faults == faults:
                self._faults = faults
                return
        raise NoReplyError(f"{self.line.name}: the meter does not take its settings (status {status})")

    def _tell(self, command: str) -> None:
        self.line.send(command.encode("ascii") + END)

    def _ask(self, query: str, pattern: str) -> str:
        wanted = re.compile(pattern)

        def exchange() -> str:
            self._tell(query)
            deadline = self.line.deadline(len(query) + MOST_BYTES)
            reply = self.line.read_until(END, deadline).decode("latin-1").strip(" \r")
            if wanted.fullmatch(reply) is None:
                raise BadReplyError(f"{self.line.name}: {reply[:40]!r} does not answer {query}")
            return reply

        return repeated(self.line, query, exchange, self._resynchronise)

    def _resynchronise(self) -> None:
        """Drain the line, then wait for the answer to `W?`: replies older than that come before it."""
        self.line.drain()
        self._tell("W?")
        deadline = self.line.deadline(2 * MOST_BYTES)
        while re.fullmatch(rb"\d{4}\r?", self.line.read_until(END, deadline)) is None:
            pass
        self.line.drain()


def connect(settings: Connection, context: Context) -> Newport1830C:
    """Return the meter of a rig file."""
    return Newport1830C(make_line(settings, context))

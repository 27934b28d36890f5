"""Newport 1830-C optical power meter: ASCII, LF, replies within 500 ms.

Replies carry neither address nor command. After any fault the line is drained and a question with a
known answer (`W?`) is asked until that answer comes: everything older is stale. A reading has no
checksum, so the median of three is taken; a hand on the front panel can change the units, so they are
set before the readings and asked for after them.

Source: Newport, Model 1830-C Instruction Manual, RS-232C interface.
"""

from __future__ import annotations

import re
from statistics import median

from clbrdf.rig.errors import BadReplyError, InstrumentError, LineError, OutOfBandError
from clbrdf.rig.transport import Line, repeated

ROLE = "reference"
END = b"\n"
MOST_BYTES = 32

POWER = r"[+-]?(?:\d+\.?\d*|\.\d+)E[+-]?\d+"
WATTS = "1"
PARAMETER_ERROR, COMMAND_ERROR, SATURATED, OVER_RANGE = 1, 2, 4, 8
OUTLIER = 6.0
"""Readings that differ from their median by more than this many times their noise are logged."""


class Newport1830C:
    """The power meter that watches the lamp."""

    def __init__(self, line: Line) -> None:
        self.line = line
        self._wavelength = ""
        self._noise = 0.0
        self._faults = -1

    def identify(self) -> str:
        """Get the units in use, "1" to "4" for W, dBm, dB, REL; the echo is switched off first.

        Raises
        ------
        InstrumentError
            What answers is no 1830-C.
        """
        try:
            self._tell("E0")
            self.line.drain()  # the echo of E0 itself
            return self._ask("U?", r"[1-4]")
        except LineError as error:
            raise InstrumentError(
                f"{self.line.name}: no 1830-C answers on {self.line.port};"
                " check the port and the baud rate in the rig file"
            ) from error

    def configure(self, wavelength: float, noise: float) -> None:
        """Set watts, no echo, attenuator off, and the wavelength in nm, whole numbers.

        `noise`, the relative standard deviation of one reading, tells which readings are outliers.
        """
        self._wavelength = f"{round(wavelength):04d}"
        self._noise = noise
        self._configure()

    def measure_power(self) -> float:
        """Measure the power in W, at least 0: the median of three readings.

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
            self._tell("U1")
            readings = [float(self._ask("D?", POWER)) for _ in range(3)]
            units = self._ask("U?", r"[1-4]")
            status = int(self._ask("Q?", r"\d{1,3}"))
            if units != WATTS:
                self.line.fault("units changed", f"units are {units}, not {WATTS} (W); set again")
            elif status & (PARAMETER_ERROR | COMMAND_ERROR):
                self.line.fault("command error", f"status {status}")
                self._tell("CS")
            elif status & (SATURATED | OVER_RANGE):
                raise OutOfBandError(f"{self.line.name}: the reference detector is saturated ({status})")
            elif median(readings) < 0.0:
                self.line.fault("bad reply", f"negative power among {readings}")
            elif self.line.faults == faults:
                self._log_outliers(readings)
                return median(readings)
        raise OutOfBandError(f"{self.line.name}: no steady reading of the reference power in four tries")

    def _log_outliers(self, readings: list[float]) -> None:
        middle = median(readings)
        if any(abs(value - middle) > OUTLIER * self._noise * middle for value in readings):
            self.line.fault("reading disagrees", f"{readings} W; the median is used")

    def _configure(self) -> None:
        """Set everything again: after a fault the meter may have been switched off and on."""
        for _ in range(3):
            faults = self.line.faults
            for command in ("CS", "E0", "A0", "U1", f"W{self._wavelength}"):
                self._tell(command)
            self.line.drain()
            if self._ask("W?", r"\d{4}") != self._wavelength or self._ask("U?", r"[1-4]") != WATTS:
                self.line.fault("setting disagrees", "wavelength or units; set again")
            if self.line.faults == faults:
                break
        self._faults = self.line.faults

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


DRIVER = Newport1830C

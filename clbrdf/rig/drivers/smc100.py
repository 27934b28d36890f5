"""Newport SMC100CC/PP controllers: ASCII, up to 31 axes on one line, CR LF both ways.

Setters are silent, so what they did is asked for: `TE` after a command, `TS` while it runs, `TP` when it
should be over. Replies repeat address and command, which tells a stale one; positions have no checksum,
so two readings have to agree, within a tolerance because a servo hunts. `TS` clears the error bits that
it reports: a status after a lost reply is marked as doubtful.

Source: Newport, SMC100CC & SMC100PP User's Manual (EDH0206En2042), chapter 6; every command sent is
listed in docs/protocols.md.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from clbrdf.rig.connection import Context, SerialConnection
from clbrdf.rig.errors import BadReplyError, InstrumentError, LineError, RefusedError
from clbrdf.rig.roles import Motion, StageStatus
from clbrdf.rig.transport import SerialLine, make_line, repeated, why_silent
from clbrdf.storage.tomlfile import TomlTable

ROLES = ("stages",)
END = b"\r\n"
NUMBER = r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"
MOST_BYTES = 64
MOST_READINGS = 8

RESET_AGAIN = 1.5
"""Seconds in which a controller that answers has begun to reset."""

STATES = {
    **dict.fromkeys(range(0x0A, 0x12), Motion.NOT_REFERENCED),
    0x14: Motion.CONFIGURATION,
    0x1E: Motion.HOMING,
    0x1F: Motion.HOMING,
    0x28: Motion.MOVING,
    **dict.fromkeys(range(0x32, 0x36), Motion.READY),
    **dict.fromkeys(range(0x3C, 0x3F), Motion.DISABLED),
    0x46: Motion.MOVING,
    0x47: Motion.MOVING,
}
LIMIT_BITS, STALL_BIT = 0x3, 0x20
STALLED_STATE = 0x3D
ERROR_BITS = {
    0x200: "80 W output power exceeded",
    0x100: "DC voltage too low",
    0x80: "wrong stage",
    0x40: "homing time-out",
    0x20: "following error",
    0x10: "short circuit",
    0x8: "RMS current limit",
    0x4: "peak current limit",
    0x2: "positive end of run",
    0x1: "negative end of run",
}
COMMAND_ERRORS = {
    "@": "none",
    "A": "unknown code or address",
    "B": "wrong address",
    "C": "parameter out of range",
    "D": "not allowed",
    "E": "homing already started",
    "G": "displacement out of limits",
    "H": "not allowed while not referenced",
    "I": "not allowed in configuration",
    "J": "not allowed while disabled",
    "K": "not allowed while ready",
    "L": "not allowed while homing",
    "M": "not allowed while moving",
    "N": "target outside the soft limits",
    "S": "communication time-out",
    "U": "EEPROM",
    "V": "execution",
}
DAMAGED = "ABCGNS"
"""Errors that a damaged command explains: the command may be sent again."""


class Connection(SerialConnection):
    """The line of all axes."""

    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 57600


class Axis(TomlTable):
    """One controller: its address on the line, 1 to 31."""

    address: Annotated[int, Field(ge=1, le=31)]


class Smc100Stage:
    """One axis of an SMC100 line, address 1 to 31."""

    def __init__(self, line: SerialLine, address: int) -> None:
        self.line = line
        self.address = address
        self._firmware = ""
        self._reset_at = -math.inf

    def identify(self) -> str:
        """Get the firmware's name.

        Raises
        ------
        InstrumentError
            What answers at this address is no SMC100.
        """
        try:
            self.get_status()
            self._firmware = self._agreed("VE", r"[ -~]+")
            return self._firmware.strip()
        except LineError as error:
            what = f"SMC100 at address {self.address}"
            raise InstrumentError(why_silent(self.line, error, what)) from error

    def get_status(self) -> StageStatus:
        """Get error bits and state (`TS`): ready is 32 to 35, "not moving" alone is not."""
        faults = self.line.faults
        word = int(self._ask("TS", r"[0-9A-Fa-f]{6}"), 16)
        bits, state = word >> 8, word & 0xFF
        if state not in STATES:
            raise RefusedError(
                f"{self.line.name}: address {self.address} reports the unknown state {state:02X}"
            )
        return StageStatus(
            STATES[state],
            limit=bool(bits & LIMIT_BITS),
            stalled=bool(bits & STALL_BIT) or state == STALLED_STATE,
            errors=tuple(text for bit, text in ERROR_BITS.items() if bits & bit),
            doubtful=self.line.faults != faults,
        )

    def get_position(self, tolerance: float) -> float:
        """Measure the position in degrees: the mean of two readings that agree within the tolerance.

        A digit lost on the line would not agree; the counts by which a servo hunts do.
        """
        before = float(self._ask("TP", NUMBER))
        for _ in range(MOST_READINGS):
            again = float(self._ask("TP", NUMBER))
            if abs(again - before) <= tolerance:
                return (before + again) / 2.0
            self.line.fault("reading disagrees", f"{self.address}TP: {before:g}, then {again:g}")
            before = again
        raise BadReplyError(
            f"{self.line.name}: no two positions of address {self.address} agree within {tolerance:g}°"
        )

    def start_move(self, target: float) -> None:
        """Set the target in degrees, to 0.0001°, and set off (`PA`).

        Raises
        ------
        RefusedError
            The controller does not accept the move.
        """
        self._set("PA", _decimal(target))

    def start_homing(self) -> None:
        """Set off for the home position (`OR`); sent once and never repeated."""
        self._tell("OR")
        self._check("OR")

    def is_unreferenced(self) -> bool:
        """Bring the controller to "not referenced", from which `OR` starts; True once it is there.

        `RS` sets it back to its state after power-on; a controller in configuration leaves that by `PW0`
        and is silent for up to 10 s then, so a LineError meanwhile means nothing. Neither is confirmed: a
        controller that RESET_AGAIN later still tells of another state has not heard it.
        """
        motion = self.get_status().motion
        if motion is Motion.NOT_REFERENCED:
            self._reset_at = -math.inf
            return True
        if time.monotonic() > self._reset_at + RESET_AGAIN:
            self._reset_at = time.monotonic()
            if motion is Motion.CONFIGURATION:
                self._tell("PW", "0")
            else:
                self._tell("RS")
        return False

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Set soft limits in degrees, velocity in deg/s, acceleration in deg/s²; each is read back.

        Raises
        ------
        RefusedError
            A value was not taken.
        """
        for code, value in (("SL", limits[0]), ("SR", limits[1]), ("VA", velocity), ("AC", acceleration)):
            for _ in range(3):
                self._set(code, _decimal(value))
                found = self._number(code, "?")
                if found == float(_decimal(value)):
                    break
                self.line.fault("setting disagrees", f"{self.address}{code} is {found:g}, not {value:g}")
            else:
                raise RefusedError(f"{self.line.name}: address {self.address} does not take {code}{value:g}")

    def _set(self, code: str, value: str) -> None:
        """Send a setter that may be repeated, and ask whether it was understood."""
        for _ in range(3):
            self._tell(code, value)
            letter = self._command_error()
            if letter == "@":
                return
            self.line.fault("command error", f"{self.address}{code}{value}: {COMMAND_ERRORS[letter]}")
            if letter not in DAMAGED:
                break
        raise RefusedError(
            f"{self.line.name}: address {self.address} refuses {code}{value}: {COMMAND_ERRORS[letter]}"
        )

    def _check(self, code: str) -> None:
        letter = self._command_error()
        if letter != "@":
            self.line.fault("command error", f"{self.address}{code}: {COMMAND_ERRORS[letter]}")
            raise RefusedError(
                f"{self.line.name}: address {self.address} refuses {code}: {COMMAND_ERRORS[letter]}"
            )

    def _command_error(self) -> str:
        letter = self._ask("TE", r"[@A-Z]")
        if letter not in COMMAND_ERRORS:
            self.line.fault("command error", f"unknown letter {letter}")
            return "S"
        return letter

    def _tell(self, code: str, value: str = "") -> None:
        self.line.send(f"{self.address}{code}{value}".encode("ascii") + END)

    def _number(self, code: str, value: str = "") -> float:
        return float(self._ask(code, NUMBER, value))

    def _agreed(self, code: str, pattern: str, value: str = "") -> str:
        """Ask until two answers in a row are the same: replies have no checksum."""
        before = self._ask(code, pattern, value)
        for _ in range(MOST_READINGS):
            again = self._ask(code, pattern, value)
            if again == before:
                return again
            self.line.fault("reading disagrees", f"{self.address}{code}{value}: {before}, then {again}")
            before = again
        raise BadReplyError(f"{self.line.name}: no two answers to {self.address}{code}{value} agree")

    def _ask(self, code: str, pattern: str, value: str = "") -> str:
        """Send a query and return the value of its reply, read strictly."""
        request = f"{self.address}{code}{value}".encode("ascii") + END
        wanted = re.compile(rf"{self.address}{code}({pattern})")

        def exchange() -> str:
            self.line.send(request)
            deadline = self.line.deadline(len(request) + MOST_BYTES)
            reply = self.line.read_until(END, deadline)
            match = wanted.fullmatch(reply.decode("latin-1"))
            if match is None:
                raise BadReplyError(f"{self.line.name}: {reply[:40]!r} does not answer {self.address}{code}")
            return match[1]

        return repeated(self.line, f"{self.address}{code}", exchange, self._resynchronise)

    def _resynchronise(self) -> None:
        """Drain the line, then ask for the firmware until the answer comes: older replies come before it."""
        self.line.drain()
        request = f"{self.address}VE".encode("ascii")
        self.line.send(request + END)
        wanted = request + self._firmware.encode("ascii")
        deadline = self.line.deadline(2 * MOST_BYTES)
        while not self.line.read_until(END, deadline).startswith(wanted):
            pass
        self.line.drain()


def _decimal(value: float) -> str:
    """Return a number with at most four decimals, and no more than it needs."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


class Smc100Line:
    """All controllers of one line, by the name of their axis."""

    def __init__(self, line: SerialLine, addresses: Mapping[str, int]) -> None:
        self.line = line
        self.stages = {name: Smc100Stage(line, address) for name, address in addresses.items()}

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
        """Get the firmware of every controller."""
        self.line.drain()
        return "; ".join(stage.identify() for stage in self.stages.values())

    def stop(self) -> None:
        """Stop every stage on the line (`ST`)."""
        self.line.send(b"ST" + END)


def connect(settings: Connection, axes: Mapping[str, Axis], context: Context) -> Smc100Line:
    """Return the controllers of a rig file."""
    return Smc100Line(make_line(settings, context), {name: axis.address for name, axis in axes.items()})

"""Emulated Newport 1830-C: ASCII, LF; strict, and left in whatever state its last user left it.

Written from the manual's command list and its appendix on the status byte, not from our driver: what the
manual does not list is a command error, a value outside its list a parameter error; both stay in the
status byte until `C`. It powers up with the echo on and shows a new reading every tenth of a second.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Sequence

from clbrdf.rig.emulator.world import World

END = b"\n"
PARAMETER_BIT, COMMAND_BIT, SATURATION_BIT, OVER_RANGE_BIT = 1, 2, 4, 8
AVAILABLE_BIT, BUSY_BIT, DONE_BIT = 16, 32, 128
WATTS, DBM, DECIBEL, RELATIVE = "1", "2", "3", "4"
PERIOD = 0.1
"""Time of the rig between two readings, s."""

BUSY_TIME = 0.5
"""After power-on or a change of range, s of the rig's time."""

AVERAGED = {"1": 16, "2": 4, "3": 1}
"""Readings in the running average of the filters slow, medium and fast."""

CHOICES = {
    "A": "[01]",
    "B": "[01]",
    "E": "[01]",
    "F": "[123]",
    "G": "[01]",
    "K": "[012]",
    "L": "[01]",
    "R": "[0-8]",
    "U": "[1-4]",
    "W": "[0-9]{4}",
    "Z": "[01]",
}
"""Settings of the manual's list and the values they take; all but the echo can be asked for with `?`."""

LAMP_OUT_READINGS = 12
LAMP_OUT = 0.67
RANGE_TOP = {str(k): 10.0 ** (k - 9) for k in range(1, 9)}
"""Full scale of the ranges, W: one decade each."""


class EmulatedPowerMeter:
    """The reference detector as a device of the emulator.

    Parameters
    ----------
    world : World
    left : sequence of str
        Commands that the last user gave it; the meter keeps them through power-off.
    """

    name = "reference"

    def __init__(self, world: World, left: Sequence[str] = ()) -> None:
        self.world = world
        self.left = tuple(left)
        self._out = 0
        self._number = 0
        self._readings: deque[float] = deque(maxlen=max(AVERAGED.values()))
        self._switch_on()

    def _switch_on(self) -> None:
        self.state = {"A": "0", "B": "1", "F": "2", "G": "1", "K": "1", "L": "0", "R": "0", "U": DBM}
        self.state |= {"W": "0633", "Z": "0", "E": "1"}
        self.errors = 0
        self.zero = 0.0
        self.stored = 1e-3
        self._seen = self._taken()
        self._busy_until = -1.0
        for command in self.left:
            self._obey(command)
        self._busy_until = self.world.clock.now() + BUSY_TIME

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first line, its LF included."""
        place = buffer.find(END)
        if place < 0:
            return None
        line = bytes(buffer[: place + 1])
        del buffer[: place + 1]
        return line

    def text(self, request: bytes) -> str:
        """Return the line without its end."""
        return request.decode("latin-1").strip()

    def answer(self, request: bytes) -> bytes:
        """Obey one line; with the echo on it is sent back first."""
        line = request[:-1].decode("latin-1").strip().upper()
        echo = request if self.state["E"] == "1" else b""
        value = self._obey(line)
        return echo + (b"" if value is None else value.encode("ascii") + END)

    def _obey(self, line: str) -> str | None:
        if not line:
            return None
        code, rest = line[0], line[1:]
        if line == "D?":
            return self._reading()
        if line == "Q?":
            return str(self._status())
        if line == "C":
            self.errors = 0
            self._seen = self._taken()
        elif line == "S":
            self.stored = max(self._value(), 1e-15)
        elif code not in CHOICES or (code == "E" and rest == "?"):
            self.errors |= COMMAND_BIT
        elif rest == "?":
            return self.state[code]
        elif not re.fullmatch(CHOICES[code], rest):
            self.errors |= PARAMETER_BIT
        else:
            self._set(code, rest)
        return None

    def _set(self, code: str, value: str) -> None:
        if code == "Z":
            self.zero = self.world.reference_reading() if value == "1" else 0.0
        if code == "R":
            self._busy_until = self.world.clock.now() + BUSY_TIME
        if code == "G" and value == "1" and self.state["G"] == "0":
            self._number = self._seen = self._clock_number()
        self.state[code] = value

    def _clock_number(self) -> int:
        return int(self.world.clock.now() / PERIOD)

    def _taken(self) -> int:
        """Return the number of the latest reading; in hold and while busy there are no new ones."""
        if self.state.get("G", "1") == "1" and self.world.clock.now() >= getattr(self, "_busy_until", -1.0):
            self._catch_up(self._clock_number())
        return self._number

    def _catch_up(self, number: int) -> None:
        fresh = min(number - self._number, self._readings.maxlen or 1)
        for _ in range(fresh if self._readings else max(fresh, 1)):
            self._readings.append(self.world.reference_reading())
        self._number = number

    def _status(self) -> int:
        busy = self.world.clock.now() < self._busy_until
        done = self._taken() > self._seen
        value = self.errors | (BUSY_BIT if busy else 0) | (DONE_BIT if done else 0)
        return value | (OVER_RANGE_BIT if self._is_over() else 0)

    def _is_over(self) -> bool:
        chosen = self.state["R"]
        return chosen != "0" and bool(self._readings) and self._readings[-1] > RANGE_TOP[chosen]

    def _value(self) -> float:
        """Return the power that the meter shows, W."""
        self._taken()
        if not self._readings:
            self._readings.append(self.world.reference_reading())
        count = AVERAGED[self.state["F"]]
        latest = list(self._readings)[-count:]
        value = sum(latest) / len(latest) - self.zero
        # With the attenuator factor switched in, the meter multiplies; here no attenuator is mounted.
        value *= 1000.0 if self.state["A"] == "1" else 1.0
        return min(value, RANGE_TOP[self.state["R"]]) if self.state["R"] != "0" else value

    def _reading(self) -> str:
        self.world.lamp_factor = LAMP_OUT if self._out else 1.0
        self._out = max(0, self._out - 1)
        power = self._value()
        self._seen = self._number
        units = self.state["U"]
        if units == DBM:
            power = 10.0 * math.log10(max(power, 1e-15) / 1e-3)
        elif units == DECIBEL:
            power = 10.0 * math.log10(max(power, 1e-15) / self.stored)
        elif units == RELATIVE:
            power = power / self.stored
        return scientific(power)

    def power_cut(self) -> bytes:
        """Start again with the echo on."""
        self._switch_on()
        return b""

    def happens(self, fault: str, request: bytes) -> bool:
        """Let it happen at a reading, where both show."""
        if self.text(request) != "D?" or self.state["E"] == "1":
            return False
        if fault == "front_panel":
            self.state["U"] = DBM
        else:
            self._out = LAMP_OUT_READINGS
        return True


def scientific(value: float) -> str:
    """Return a number the way the meter writes it: 7.5123E-4, 5E-9."""
    mantissa, exponent = f"{value:.4e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}E{int(exponent)}"

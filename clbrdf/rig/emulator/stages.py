"""Emulated SMC100 controllers: three axes on one line, with motion that takes time.

Written from the manual's tables, not from our driver: a command that the manual does not list, a value
out of its range, or a state in which it is not allowed leaves an error letter for `TE` and no reply. `TS`
clears the error bits that it reports.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from clbrdf.rig.emulator.world import Clock
from clbrdf.rig.stagesettings import AXES, StagesSettings

END = b"\r\n"
NUMBER = re.compile(r"-?\d+(\.\d+)?")
HARD_MARGIN = 5.0
"""The limit switches stand this far outside the rig file's limits, degrees."""

RESET, CONFIGURATION, HOMING, MOVING = 0x0A, 0x14, 0x1E, 0x28
READY_FROM_HOMING, READY_FROM_MOVING, READY_FROM_DISABLE = 0x32, 0x33, 0x34
DISABLED_FROM_READY, DISABLED_FROM_MOVING = 0x3C, 0x3D
READY = (0x32, 0x33, 0x34, 0x35)
POSITIVE_END, NEGATIVE_END, FOLLOWING_ERROR = 0x2, 0x1, 0x20
ALLOWED: dict[str, Callable[[float], bool]] = {
    "VA": lambda v: 1e-6 < v < 1e12,
    "AC": lambda v: 1e-6 < v < 1e12,
    "SL": lambda v: -1e12 < v <= 0.0,
    "SR": lambda v: 0.0 <= v < 1e12,
}
"""Ranges of the settings."""

SILENCE = 3.0
"""After configuration is left the controller does not answer for this long, s of the rig's time."""


@dataclass
class Move:
    """A motion with a trapezoidal velocity profile from rest to rest."""

    start: float
    target: float
    began: float
    velocity: float
    acceleration: float

    @property
    def duration(self) -> float:
        """Seconds from start to end."""
        distance = abs(self.target - self.start)
        ramp = self.velocity / self.acceleration
        if distance < self.velocity * ramp:
            return float(2.0 * np.sqrt(distance / self.acceleration))
        return distance / self.velocity + ramp

    def position(self, now: float) -> float:
        """Where it stands at a time."""
        total, distance = self.duration, abs(self.target - self.start)
        t = min(max(now - self.began, 0.0), total)
        ramp = min(self.velocity / self.acceleration, total / 2.0)
        peak = self.acceleration * ramp
        if t < ramp:
            gone = 0.5 * self.acceleration * t * t
        elif t < total - ramp:
            gone = 0.5 * peak * ramp + peak * (t - ramp)
        else:
            gone = distance - 0.5 * self.acceleration * (total - t) ** 2
        return self.start + float(np.copysign(gone, self.target - self.start))


@dataclass
class EmulatedAxis:
    """State of one controller."""

    address: int
    velocity: float
    acceleration: float
    lowest: float
    highest: float
    state: int = RESET
    errors: int = 0
    last_error: str = "@"
    place: float = 0.0
    deviation: float = 0.0
    move: Move | None = None
    ends_as: tuple[int, int] = (READY_FROM_MOVING, 0)
    coming: str = ""
    silent_until: float = -1.0
    defaults: dict[str, float] = field(default_factory=dict)

    def update(self, now: float) -> None:
        """Bring the state to a time: end what is over."""
        if self.move is not None and now >= self.move.began + self.move.duration:
            self.place, self.move = self.move.target, None
            self.state, bits = self.ends_as
            self.errors |= bits

    def position(self, now: float) -> float:
        """Return the encoder's position, degrees."""
        return self.place if self.move is None else self.move.position(now)


class EmulatedStages:
    """The line of controllers as a device of the emulator."""

    name = "stages"

    def __init__(
        self, settings: StagesSettings, clock: Clock, angle_noise: float, seed: int, hunting: float = 0.0
    ) -> None:
        self.clock = clock
        self.hunting = hunting
        self.settings = settings
        self.angle_noise = angle_noise
        self._random = np.random.default_rng([seed, 78])
        self.axes = {}
        for name in AXES:
            stage = getattr(settings, name)
            if not hasattr(stage, "address"):  # an axis of another driver
                continue
            low, high = stage.raw_limits
            axis = EmulatedAxis(stage.address, 20.0, 80.0, low - HARD_MARGIN, high + HARD_MARGIN)
            axis.defaults = {"VA": 20.0, "AC": 80.0, "SL": low - HARD_MARGIN, "SR": high + HARD_MARGIN}
            axis.place = 3.0  # wherever the last user left it
            self.axes[stage.address] = axis

    def true_angles(self) -> tuple[float, ...]:
        """Where the stages really stand, as rig angles (lamp, turn, pitch), degrees."""
        now = self.clock.now()
        angles = []
        for name in AXES:
            stage = getattr(self.settings, name)
            if not hasattr(stage, "address"):
                angles.append(0.0)
                continue
            axis = self.axes[stage.address]
            axis.update(now)
            angles.append(stage.from_raw(axis.position(now)) + stage.sign * axis.deviation)
        return tuple(angles)

    def take(self, buffer: bytearray) -> bytes | None:
        """Remove the first line, its CR LF included."""
        place = buffer.find(END)
        if place < 0:
            return None
        line = bytes(buffer[: place + len(END)])
        del buffer[: place + len(END)]
        return line

    def text(self, request: bytes) -> str:
        """Return the line without its end."""
        return request.decode("latin-1").strip()

    def answer(self, request: bytes) -> bytes:
        """Obey one line."""
        line = "".join(request[: -len(END)].decode("latin-1").split(" ")).upper()
        if line == "ST":
            for axis in self.axes.values():
                self._stop(axis)
            return b""
        match = re.fullmatch(r"(\d{1,2})([A-Z]{2})(.*)", line, re.DOTALL)
        if match is None:
            self._complain_all("A")
            return b""
        found = self.axes.get(int(match[1]))
        if found is None:
            return b""
        found.update(self.clock.now())
        if self.clock.now() < found.silent_until:
            return b""
        value = self._obey(found, match[2], match[3])
        return b"" if value is None else f"{found.address}{match[2]}{value}".encode("ascii") + END

    def _complain_all(self, letter: str) -> None:
        for axis in self.axes.values():
            axis.last_error = letter

    def _obey(self, axis: EmulatedAxis, code: str, value: str) -> str | None:
        now = self.clock.now()
        if code == "TP" and value in ("", "?"):
            hunt = self.hunting * float(self._random.uniform(-1.0, 1.0)) if self.hunting else 0.0
            return "0" if axis.state == RESET else _number(axis.position(now) + hunt)
        if code == "TS" and value in ("", "?"):
            bits, axis.errors = axis.errors, 0
            return f"{bits:04X}{axis.state:02X}"
        if code == "TE" and value in ("", "?"):
            letter, axis.last_error = axis.last_error, "@"
            return letter
        if code == "VE" and value in ("", "?"):
            return " SMC_CC_2.0.1"
        if code == "ID" and value == "?":
            return "MRS101"
        if code in axis.defaults:
            return self._setting(axis, code, value)
        if code == "PT" and NUMBER.fullmatch(value) and 1e-6 < float(value) < 1e12:
            move = Move(0.0, float(value), now, axis.defaults["VA"], axis.defaults["AC"])
            return _number(move.duration)
        letter = self._act(axis, code, value)
        if letter != "@":
            axis.last_error = letter
        return None

    def _setting(self, axis: EmulatedAxis, code: str, value: str) -> str | None:
        if value == "?":
            return _number(axis.defaults[code])
        refused = {RESET: "H", HOMING: "L", MOVING: "M"}.get(axis.state)
        if not NUMBER.fullmatch(value) or not ALLOWED[code](float(value)):
            axis.last_error = "C"
        elif refused:
            axis.last_error = refused
        else:
            axis.defaults[code] = float(value)
        return None

    def _act(self, axis: EmulatedAxis, code: str, value: str) -> str:
        if code == "RS" and not value:
            self._reset(axis)
            return "@"
        if code == "ST" and not value:
            self._stop(axis)
            return "@"
        if code == "OR" and not value:
            if axis.state != RESET:
                return "M" if axis.state == MOVING else "E" if axis.state == HOMING else "K"
            self._set_off(axis, 0.0, HOMING, READY_FROM_HOMING)
            return "@"
        if code in ("PA", "PR"):
            return self._start(axis, code, value)
        if code == "MM" and value in ("0", "1"):
            return self._enable(axis, value == "1")
        if code in ("MM", "PW", "PT"):
            if code == "PT" or value not in ("0", "1"):
                return "C"
            if axis.state != (RESET if value == "1" else CONFIGURATION):
                return "D"
            axis.state = CONFIGURATION if value == "1" else RESET
            if value == "0":
                axis.silent_until = self.clock.now() + SILENCE
            return "@"
        return "A"

    def _start(self, axis: EmulatedAxis, code: str, value: str) -> str:
        if not NUMBER.fullmatch(value):
            return "C"
        if axis.state not in READY:
            return {RESET: "H", CONFIGURATION: "I", HOMING: "L", MOVING: "M"}.get(axis.state, "J")
        here = axis.position(self.clock.now())
        target = float(value) + (here if code == "PR" else 0.0)
        if not axis.defaults["SL"] <= target <= axis.defaults["SR"]:
            return "N"
        axis.errors = 0
        fault, axis.coming = axis.coming, ""
        halfway = round((here + target) / 2.0, 4)
        if fault == "stall":
            self._set_off(axis, halfway, MOVING, DISABLED_FROM_MOVING, FOLLOWING_ERROR)
        elif fault == "limit_switch":
            end = POSITIVE_END if target > here else NEGATIVE_END
            self._set_off(axis, halfway, MOVING, READY_FROM_MOVING, end)
        else:
            self._set_off(axis, round(target, 4), MOVING, READY_FROM_MOVING)
        if self.angle_noise:
            axis.deviation = float(self.angle_noise * self._random.standard_normal())
        return "@"

    def _set_off(self, axis: EmulatedAxis, target: float, state: int, end: int, bits: int = 0) -> None:
        now = self.clock.now()
        here = axis.position(now)
        axis.move = Move(here, target, now, axis.defaults["VA"], axis.defaults["AC"])
        axis.state, axis.ends_as = state, (end, bits)

    def _enable(self, axis: EmulatedAxis, on: bool) -> str:
        if on and axis.state in (DISABLED_FROM_READY, DISABLED_FROM_MOVING):
            axis.state, axis.errors = READY_FROM_DISABLE, 0
        elif not on and axis.state in READY:
            axis.state = DISABLED_FROM_READY
        else:
            return "D"
        return "@"

    def _stop(self, axis: EmulatedAxis) -> None:
        now = self.clock.now()
        axis.update(now)
        if axis.move is not None and axis.state == MOVING:
            axis.place, axis.move = axis.position(now), None
            axis.state = READY_FROM_MOVING

    def _reset(self, axis: EmulatedAxis) -> None:
        axis.place = axis.position(self.clock.now())
        axis.move, axis.state, axis.errors, axis.last_error = None, RESET, 0, "@"

    def power_cut(self) -> bytes:
        """All controllers start again; the line carries NUL bytes."""
        for axis in self.axes.values():
            self._reset(axis)
        return b"\0\0\0"

    def happens(self, fault: str, request: bytes) -> bool:
        """Let stalls and limits wait for a move; lose a homing at once."""
        for each in self.axes.values():
            each.update(self.clock.now())
        if fault == "homing_lost":
            axis = list(self.axes.values())[int(self._random.integers(len(self.axes)))]
            if axis.state not in READY:
                return False
            self._reset(axis)
            return True
        match = re.match(rb"(\d+)PA", request)
        if match is None or int(match[1]) not in self.axes or self.axes[int(match[1])].state not in READY:
            return False
        self.axes[int(match[1])].coming = fault
        return True


def _number(value: float) -> str:
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text

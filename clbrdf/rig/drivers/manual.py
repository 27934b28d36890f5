"""Stages that a person turns: the angle is asked for on the terminal, and waited for."""

from __future__ import annotations

import math
from collections.abc import Mapping

from clbrdf.rig.connection import Context
from clbrdf.rig.errors import InstrumentError
from clbrdf.rig.roles import Motion, StageStatus
from clbrdf.storage.tomlfile import TomlTable

ROLES = ("stages",)
MOST_ANSWERS = 5


class ManualStage:
    """One axis with a scale on it.

    The position is what the person says it is: the angle asked for, or another one that is typed.
    """

    def __init__(self, name: str, context: Context) -> None:
        self.name = name
        self.context = context
        self._at: float | None = None
        self._limits = (-math.inf, math.inf)

    def get_status(self) -> StageStatus:
        """Get ready, once its zero has been set."""
        return StageStatus(Motion.NOT_REFERENCED if self._at is None else Motion.READY)

    def get_position(self, tolerance: float) -> float:
        """Get the position in degrees that was set."""
        del tolerance
        if self._at is None:
            raise InstrumentError(f"{self.context.name}: {self.name} has not been set to its zero")
        return self._at

    def start_move(self, target: float) -> None:
        """Ask for a position in degrees, and return when it is set."""
        question = f"set {self.name} to {target:.3f}°, then press Enter (or type the angle it stands at)"
        self._at = self._asked(question, target)

    def is_unreferenced(self) -> bool:
        """Forget the position; True at once."""
        self._at = None
        return True

    def start_homing(self) -> None:
        """Ask for the zero of the scale."""
        self._at = self._asked(f"set {self.name} to 0° on its scale, then press Enter", 0.0)

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Keep the limits in degrees, to refuse what cannot have been read off."""
        del velocity, acceleration
        self._limits = limits

    def _asked(self, question: str, target: float) -> float:
        for _ in range(MOST_ANSWERS):
            answer = self.context.ask(question).strip().rstrip("°").replace(",", ".")
            if not answer:
                return target
            try:
                value = float(answer)
            except ValueError:
                question = f"{answer!r} is no angle; type degrees, or nothing for {target:.3f}°"
                continue
            low, high = self._limits
            if low <= value <= high:
                return value
            question = f"{value:g}° is outside {low:g}° to {high:g}°; type the angle again"
        raise InstrumentError(f"{self.context.name}: no angle of {self.name} in {MOST_ANSWERS} answers")


class Manual:
    """The axes that a person turns, by name."""

    is_open = False

    def __init__(self, axes: Mapping[str, TomlTable], context: Context) -> None:
        self.stages = {name: ManualStage(name, context) for name in axes}

    def open(self) -> None:
        """Do nothing but count as open."""
        self.is_open = True

    def close(self) -> None:
        """Do nothing but count as closed."""
        self.is_open = False

    def identify(self) -> str:
        """Say that it is done by hand."""
        return f"{' and '.join(self.stages)} by hand"

    def stop(self) -> None:
        """Do nothing: nothing moves by itself."""


def connect(settings: TomlTable, axes: Mapping[str, TomlTable], context: Context) -> Manual:
    """Return the axes of a rig file."""
    del settings
    return Manual(axes, context)

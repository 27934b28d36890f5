"""Newport ESP300 motion controller through pymeasure: up to three axes.

It does not tell whether an axis has been homed, so the driver remembers; after power-on the motors are
off, and an axis whose motor is off counts as not referenced.

Source: pymeasure, `pymeasure.instruments.newport.ESP300`; Newport, ESP300 User's Manual, section 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers._visa import EXTRA as EXTRA
from clbrdf.rig.drivers._visa import VisaConnection, VisaInstrument, find_resources
from clbrdf.rig.errors import BadReplyError, RefusedError
from clbrdf.rig.roles import Motion, StageStatus
from clbrdf.storage.tomlfile import TomlTable

ROLES = ("stages",)
MOST_READINGS = 8
DEGREES = 7
"""Units of an axis, in the controller's numbers."""

FOLLOWING, LIMITS = 3, (4, 5)
"""Axis errors (hundreds: the axis): following error; positive and negative hardware limit."""


class Connection(VisaConnection):
    """Its VISA resource."""


class Axis(TomlTable):
    """Number of the axis, 1 to 3."""

    axis: Annotated[int, Field(ge=1, le=3)]


class Esp300Stage:
    """One axis."""

    def __init__(self, group: Esp300, number: int) -> None:
        self.group = group
        self.number = number
        self._is_homed = False
        self._is_homing = False

    def get_status(self) -> StageStatus:
        """Get what the axis is doing, and the errors that the controller holds for it."""
        with self.group.axis(self.number) as axis:
            is_on = int(axis.values("MO?")[0]) == 1
            is_done = int(axis.values("MD?")[0]) == 1
        errors = self.group.errors_of(self.number)
        if not is_on:
            self._is_homed = self._is_homing = False
        if self._is_homing and is_done:
            self._is_homing, self._is_homed = False, not errors
        if self._is_homing:
            motion = Motion.HOMING
        elif not self._is_homed:
            motion = Motion.NOT_REFERENCED
        else:
            motion = Motion.READY if is_done else Motion.MOVING
        return StageStatus(
            motion,
            limit=any(code in LIMITS for code in errors),
            stalled=FOLLOWING in errors,
            errors=tuple(f"axis error {code:02d}" for code in errors),
        )

    def get_position(self, tolerance: float) -> float:
        """Measure the position in degrees: the mean of two readings that agree within the tolerance."""
        with self.group.axis(self.number) as axis:
            before = float(axis.position)
            for _ in range(MOST_READINGS):
                again = float(axis.position)
                if abs(again - before) <= tolerance:
                    return (before + again) / 2.0
                before = again
        raise BadReplyError(f"{self.group.name}: no two positions of axis {self.number} agree")

    def start_move(self, target: float) -> None:
        """Set the target in degrees, to 0.0001°, and set off (`PA`)."""
        with self.group.axis(self.number) as axis:
            axis.write(f"PA{target:.4f}")

    def is_unreferenced(self) -> bool:
        """Switch the motor on; homing starts from anywhere."""
        self._is_homed = self._is_homing = False
        self.group.errors_of(self.number)
        with self.group.axis(self.number) as axis:
            if int(axis.values("MO?")[0]) != 1:
                axis.enable()
                return False
        return True

    def start_homing(self) -> None:
        """Set off for the home position (`OR1`: home switch and index)."""
        with self.group.axis(self.number) as axis:
            axis.home(1)
        self._is_homing = True

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Set degrees, soft limits, velocity in deg/s, acceleration and deceleration in deg/s²; read back.

        Raises
        ------
        RefusedError
            A value was not taken.
        """
        wanted = {"SN": DEGREES, "SL": limits[0], "SR": limits[1], "VA": velocity, "AC": acceleration}
        wanted["AG"] = acceleration
        with self.group.axis(self.number) as axis:
            for code, value in wanted.items():
                axis.write(f"{code}{value:g}")
                found = float(axis.values(f"{code}?")[0])
                if abs(found - value) > 1e-3 * max(1.0, abs(value)):
                    raise RefusedError(
                        f"{self.group.name}: axis {self.number} does not take {code}{value:g} ({found:g})"
                    )


class Esp300:
    """The controller and its axes, by name."""

    def __init__(self, settings: Connection, axes: Mapping[str, Axis], context: Context) -> None:
        self.visa = VisaInstrument("pymeasure.instruments.newport", "ESP300", settings, context)
        self.name = context.name
        self.stages = {name: Esp300Stage(self, axis.axis) for name, axis in axes.items()}
        self._errors: list[int] = []

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self.visa.is_open

    def open(self) -> None:
        """Connect; forget every reference."""
        self.visa.open()
        for stage in self.stages.values():
            stage._is_homed = stage._is_homing = False

    def close(self) -> None:
        """Disconnect."""
        self.visa.close()

    def identify(self) -> str:
        """Get its identity."""
        return self.visa.identify("ESP300")

    def stop(self) -> None:
        """Stop all axes (`ST`)."""
        with self.visa.talking() as controller:
            controller.write("ST")

    def axis(self, number: int) -> Any:
        """Return a context that lends pymeasure's axis."""
        return _AxisOf(self.visa, number)

    def errors_of(self, number: int) -> list[int]:
        """Take an axis's errors from the controller's buffer; those of others are kept for them."""
        with self.visa.talking() as controller:
            while (code := int(controller.error)) != 0:
                self._errors.append(code)
        own = [code % 100 for code in self._errors if code // 100 == number]
        self._errors = [code for code in self._errors if code // 100 not in (0, number)]
        return own


class _AxisOf:
    """Lends one axis of pymeasure's controller while errors are translated."""

    def __init__(self, visa: VisaInstrument, number: int) -> None:
        self._talk = visa.talking()
        self._number = number

    def __enter__(self) -> Any:
        controller = self._talk.__enter__()
        return (controller.x, controller.y, controller.phi)[self._number - 1]

    def __exit__(self, *details: Any) -> bool | None:
        return self._talk.__exit__(*details)


def connect(settings: Connection, axes: Mapping[str, Axis], context: Context) -> Esp300:
    """Return the controller of a rig file."""
    return Esp300(settings, axes, context)


def find() -> list[FoundInstrument]:
    """Return the resources that may be one."""
    return find_resources(lambda name: name.startswith(("GPIB", "ASRL")))

"""The stages of a rig file: axes, limits, speeds, collision zones."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, SerializeAsAny, model_validator

from clbrdf.rig.zones import Zone
from clbrdf.storage.tomlfile import TomlTable

AXES = ("lamp", "turn", "pitch")
"""The three axes, in the order of every axis array."""

Axis = Literal["lamp", "turn", "pitch"]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]


class StageSettings(TomlTable):
    """One axis: rig angle = sign · (controller's position − zero).

    Attributes
    ----------
    driver : str
        Of this axis alone, where it differs from that of the others and shares no line with them.
    limits : (float, float)
        Lowest and highest rig angle, degrees, inside the hard limits.
    velocity, acceleration : float
        deg/s, deg/s².
    zero : float
        Controller's position at rig angle 0, degrees.
    sign : int
        1, or −1 where the stage turns the other way.
    """

    driver: str = ""
    limits: tuple[Angle, Angle]
    velocity: Positive = 20.0
    acceleration: Positive = 80.0
    zero: Angle = 0.0
    sign: Annotated[int, Field(ge=-1, le=1)] = 1

    @model_validator(mode="after")
    def _check(self) -> StageSettings:
        low, high = self.limits
        if not low < high:
            raise ValueError(f"limits are [{low:g}, {high:g}]; give the lower angle first, then a higher one")
        if self.sign == 0:
            raise ValueError("sign is 0; give 1 or -1")
        home = self.from_raw(0.0)
        if not low <= home <= high:
            raise ValueError(f"limits [{low:g}, {high:g}] leave out the home position, {home:g}°")
        return self

    @property
    def raw_limits(self) -> tuple[float, float]:
        """The limits in the controller's positions, lower first."""
        ends = sorted(self.to_raw(limit) for limit in self.limits)
        return ends[0], ends[1]

    def to_raw(self, angle: float) -> float:
        """Return the controller's position for a rig angle, to the 0.0001° that travel on the line."""
        return round(self.zero + self.sign * angle, 4)

    def from_raw(self, position: float) -> float:
        """Return the rig angle for a controller's position."""
        return round(self.sign * (position - self.zero), 4)

    def travel_time(self, distance: float) -> float:
        """Return the seconds for a move of `distance` degrees with a trapezoidal velocity profile."""
        ramp = self.velocity**2 / self.acceleration
        if distance < ramp:
            return float(2.0 * (distance / self.acceleration) ** 0.5)
        return distance / self.velocity + self.velocity / self.acceleration


class ZoneSettings(TomlTable):
    """Ranges of axes that must not be held together, degrees; an axis left out counts at any angle."""

    lamp: tuple[Angle, Angle] = (-360.0, 360.0)
    turn: tuple[Angle, Angle] = (-360.0, 360.0)
    pitch: tuple[Angle, Angle] = (-360.0, 360.0)

    @model_validator(mode="after")
    def _check(self) -> ZoneSettings:
        for name in AXES:
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} is [{low:g}, {high:g}]; give the lower angle first")
        if all(getattr(self, name) == (-360.0, 360.0) for name in AXES):
            raise ValueError("names no axis: nothing could ever be reached")
        return self


class StagesSettings(TomlTable):
    """The three stages.

    Attributes
    ----------
    tolerance : float
        Between target and position, and between two readings of it, degrees; a servo hunts.
    poll, settle : float
        Between two looks at a moving stage, and after it has arrived, s.
    homing_time, reset_time, move_time : float
        Longest time to home one stage and to reset it, and what a move may take beyond the time that
        follows from velocity and acceleration, s.
    homing_order : tuple of str
        One axis after the other.
    park : (float, float, float) or None
        Rig angles to leave the stages at, degrees.
    zones : tuple of ZoneSettings
        Where they would collide.
    """

    driver: str = "smc100"
    tolerance: Positive = 0.002
    poll: NotNegative = 0.02
    settle: NotNegative = 0.0
    homing_time: Positive = 60.0
    reset_time: Positive = 10.0
    move_time: NotNegative = 0.3
    homing_order: tuple[Axis, Axis, Axis] = ("lamp", "turn", "pitch")
    park: tuple[Angle, Angle, Angle] | None = None
    zones: tuple[ZoneSettings, ...] = ()
    lamp: SerializeAsAny[StageSettings]
    turn: SerializeAsAny[StageSettings]
    pitch: SerializeAsAny[StageSettings]

    @model_validator(mode="after")
    def _check(self) -> StagesSettings:
        if set(self.homing_order) != set(AXES):
            raise ValueError(
                f"homing_order is {list(self.homing_order)}; give each of {', '.join(AXES)} once"
            )
        for key in ("address", "serial", "axis"):
            values = [getattr(getattr(self, name), key, None) for name in AXES]
            own = [value for value in values if value is not None]
            if len(set(own)) < len(own):
                raise ValueError(f"{_plural(key)} are {own}; each stage needs its own")
        for name, angle in zip(AXES, self.park or (), strict=False):
            low, high = getattr(self, name).limits
            if not low <= angle <= high:
                raise ValueError(f"park puts {name} at {angle:g}°, outside its limits [{low:g}, {high:g}]")
        return self

    def driver_of(self, name: str) -> str:
        """Return the name of the driver of an axis."""
        return str(getattr(self, name).driver) or self.driver

    @property
    def boxes(self) -> tuple[Zone, ...]:
        """The collision zones in the order of the axes."""
        return tuple((zone.lamp, zone.turn, zone.pitch) for zone in self.zones)


def _plural(key: str) -> str:
    return {"address": "addresses", "serial": "serial numbers", "axis": "axes"}[key]

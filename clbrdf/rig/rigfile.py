"""The rig file: which instruments there are, how the goniometer is built, what is safe.

Each of the sections `stages`, `spectrometer` and `reference` names a driver, and that driver says which
keys the section has besides those given here (:mod:`clbrdf.rig.drivers`).
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, SerializeAsAny, create_model, model_validator

from clbrdf.errors import InputError
from clbrdf.rig.drivers import axis_of, connection_of, get_driver
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.panel import PanelSettings, load_panel
from clbrdf.rig.zones import Zone
from clbrdf.tomlfile import Settings, load_toml

AXES = ("lamp", "turn", "pitch")
"""The three axes, in the order of every axis array."""

ROLES = ("stages", "spectrometer", "reference")

Axis = Literal["lamp", "turn", "pitch"]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]


class StageSettings(Settings):
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


class ZoneSettings(Settings):
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


class StagesSettings(Settings):
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


class SpectrometerSettings(Settings):
    """The spectrometer and what its counts are worth.

    Attributes
    ----------
    electrons_per_count : float
        For the counting noise.
    read_noise : float
        Standard deviation of a dark frame, counts, quantisation included.
    relative_noise : float
        Standard deviation of a scan that grows with its signal (power meters, lock-ins), relative.
    bias : float
        Counts at zero time and no light; they carry no counting noise.
    full_scale : int or None
        Count at which it saturates, where that is less than its largest number.
    margin : float
        Share of full scale above which a count is taken for saturated.
    shutter_time : float
        From the shutter's command until it is open or closed for good, s.
    wavelength_correction : (float, float) or ()
        Offset in nm, and nm per nm from 550 nm, to add to the spectrometer's wavelengths.
    least_signal : float
        How many times its noise the direct beam has to be, in the median over the pixels used.
    """

    driver: str = "obp"
    electrons_per_count: Positive = 2.0
    read_noise: NotNegative = 3.0
    relative_noise: NotNegative = 0.0
    bias: NotNegative = 1500.0
    full_scale: Annotated[int, Field(ge=1, le=2**32 - 1)] | None = None
    margin: Annotated[float, Field(gt=0.1, le=1.0)] = 0.95
    shutter_time: Annotated[float, Field(ge=0.0, le=60.0)] = 0.2
    wavelength_correction: tuple[()] | tuple[float, float] = ()
    least_signal: Annotated[float, Field(ge=3.0)] = 10.0


class ReferenceSettings(Settings):
    """The reference detector, and the band in which the lamp has to stay.

    Attributes
    ----------
    wavelength : float
        nm, for the meter's own calibration.
    noise : float
        Relative standard deviation of one reading.
    least : float
        Power below which there is no light on it, W.
    band : float
        Largest relative deviation from the power at the start; outside, the measurement waits.
    wait, every : float
        How long it waits, and how often it looks, s.
    """

    driver: str = "newport1830c"
    wavelength: Annotated[float, Field(ge=200.0, le=2000.0)] = 550.0
    noise: NotNegative = 0.001
    least: Positive = 1e-9
    band: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    wait: NotNegative = 600.0
    every: NotNegative = 1.0


class GeometrySettings(Settings):
    """How the goniometer is built.

    Attributes
    ----------
    solid_angle : float
        Of the detector seen from the sample, Ω of (2), sr.
    direct : (float, float, float)
        Axis angles at which the lamp shines straight into the detector past the sample, which stands
        edge-on: there the incident power of (2) is measured.
    lamp_shadow : float
        The lamp stands in the detector's view when |α| is below this, degrees.
    panel : PanelSettings or None
        A reference panel that gives the incident power instead; a person puts it in.
    largest_zenith : float
        Beyond it the holder's rim shadows the sample, degrees.
    """

    solid_angle: Annotated[float, Field(gt=0.0, lt=6.3)]
    direct: tuple[Angle, Angle, Angle] = (180.0, 90.0, 0.0)
    lamp_shadow: Annotated[float, Field(gt=0.0, lt=90.0)] = 5.0
    largest_zenith: Annotated[float, Field(gt=0.0, lt=90.0)] = 85.0
    panel: PanelSettings | None = None


class StorageSettings(Settings):
    """Free space to keep on the disk, MB: below it the measurement stops with its files intact."""

    keep_free: NotNegative = 200.0


class RecoverySettings(Settings):
    """What is done about faults that repeating an exchange does not mend.

    Attributes
    ----------
    attempts : int
        How often a point is tried.
    replug_time : float
        How long a lost port is waited for, s.
    check_tolerance : float
        How well a point repeats on this rig beyond the noise of its counts, relative standard
        deviation; a check point farther off than five of its own standard deviations is an error.
    """

    attempts: Annotated[int, Field(ge=1, le=1000)] = 8
    replug_time: Positive = 60.0
    check_tolerance: Positive = 0.005


class Rig(Settings):
    """A whole rig file."""

    name: str = "goniospectrometer"
    stages: SerializeAsAny[StagesSettings]
    spectrometer: SerializeAsAny[SpectrometerSettings]
    reference: SerializeAsAny[ReferenceSettings]
    geometry: GeometrySettings
    storage: StorageSettings = StorageSettings()
    recovery: RecoverySettings = RecoverySettings()
    emulator: EmulatorSettings | None = None

    @model_validator(mode="after")
    def _check(self) -> Rig:
        for name, angle in zip(AXES, self.geometry.direct, strict=True):
            low, high = getattr(self.stages, name).limits
            if not low <= angle <= high:
                raise ValueError(
                    f"geometry.direct puts {name} at {angle:g}°,"
                    f" outside stages.{name}.limits [{low:g}, {high:g}]"
                )
        found = [getattr(getattr(self, role), "port", "") for role in ROLES]
        ports = [port for port in found if port]
        if len(set(ports)) < len(ports):
            raise ValueError(f"ports are {', '.join(ports)}; each instrument needs its own line")
        return self

    def fingerprint(self) -> str:
        """Everything a measured value depends on, as text.

        Left out is what may change on resume: how instruments are reached, how long is waited for what,
        parking and homing, the emulator.
        """
        parts = {}
        for role in ROLES:
            section = getattr(self, role)
            connection = connection_of(role, get_driver(role, section.driver))
            parts[role] = set(connection.model_fields) | OPERATIONAL[role]
        return self.model_dump_json(exclude={"emulator": True, "storage": True, "recovery": True, **parts})


OPERATIONAL = {
    "stages": {"poll", "settle", "homing_time", "reset_time", "move_time", "homing_order", "park"},
    "spectrometer": {"shutter_time", "least_signal"},
    "reference": {"least", "band", "wait", "every"},
}
"""Settings by section that no measured value depends on."""

DEFAULT_DRIVERS = {"stages": "smc100", "spectrometer": "obp", "reference": "newport1830c"}


def rig_class(content: Mapping[str, Any]) -> type[Rig]:
    """Return the class that checks a rig file whose drivers are those named in its content.

    Raises
    ------
    InputError
        A driver that does not exist, or one for a single axis that shares its line with others.
    """
    drivers = []
    for role in ROLES:
        section = content.get(role)
        given = section.get("driver") if isinstance(section, Mapping) else None
        drivers.append(given if isinstance(given, str) else DEFAULT_DRIVERS[role])
    stages = content.get("stages")
    axes = []
    for name in AXES:
        axis = stages.get(name) if isinstance(stages, Mapping) else None
        given = axis.get("driver") if isinstance(axis, Mapping) else None
        axes.append(given if isinstance(given, str) and given else drivers[0])
    return _rig_class(*drivers, *axes)


@lru_cache(maxsize=64)
def _rig_class(stages: str, spectrometer: str, reference: str, *axes: str) -> type[Rig]:
    driver = get_driver("stages", stages)
    fields: dict[str, Any] = {}
    for name, own in zip(AXES, axes, strict=True):
        chosen = get_driver("stages", own)
        if own != stages and connection_of("stages", chosen).model_fields:
            raise InputError(
                f"stages.{name}.driver = {own!r} needs a line of its own; name it as stages.driver, and"
                " those of the other axes by their own keys"
            )
        fields[name] = (create_model("Axis", __base__=(axis_of(chosen), StageSettings)), ...)
    parts: dict[str, Any] = {
        "stages": create_model("Stages", __base__=(connection_of("stages", driver), StagesSettings), **fields)
    }
    for role, name, base in (
        ("spectrometer", spectrometer, SpectrometerSettings),
        ("reference", reference, ReferenceSettings),
    ):
        connection = connection_of(role, get_driver(role, name))
        parts[role] = create_model(role.capitalize(), __base__=(connection, base))
    sections: dict[str, Any] = {role: (kind, ...) for role, kind in parts.items()}
    made: type[Rig] = create_model("Rig", __base__=Rig, **sections)
    return made


def read_rig(text: str) -> Rig:
    """Return the rig that a file of ours carries as JSON.

    Raises
    ------
    InputError, pydantic.ValidationError
        It is not what this version knows.
    """
    content = json.loads(text)
    return rig_class(content).model_validate(content)


def load_rig(path: str | Path) -> Rig:
    """Read a rig file; relative ports are meant from its folder.

    Raises
    ------
    InputError
        As `load_toml`, or axis limits, ports or addresses that contradict each other.
    """
    try:
        kind = rig_class(_peek(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    rig = load_toml(path, kind)
    folder = Path(path).resolve().parent
    changed: dict[str, Any] = {}
    for role in ROLES:
        part = getattr(rig, role)
        if hasattr(part, "located"):
            try:
                changed[role] = part.model_copy(update=part.located(folder))
            except ValueError as error:
                raise InputError(f"{path}: {role}.{error}") from error
    panel = rig.geometry.panel
    if panel is not None:
        table = panel.model_copy(update={"table": load_panel(folder / panel.file)})
        changed["geometry"] = rig.geometry.model_copy(update={"panel": table})
    emulator = rig.emulator
    if emulator is not None and emulator.scan:
        changed["emulator"] = emulator.model_copy(update={"scan": str(folder / emulator.scan)})
    return rig.model_copy(update=changed)


def _peek(path: str | Path) -> dict[str, Any]:
    """Return what stands in a file, nothing where it cannot be read: `load_toml` says why."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return {}

"""The rig file: which instruments hang on which ports, how the goniometer is built, what is safe."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from clbrdf.errors import InputError
from clbrdf.rig.drivers import get_driver
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.tomlfile import Settings, load_toml

AXES = ("lamp", "turn", "pitch")
"""The three axes, in the order of every axis array."""

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]


class PortSettings(Settings):
    """A serial port.

    Attributes
    ----------
    port : str
        Path, relative to the rig file.
    baud : int
        Bits per second.
    patience : float
        Margin on every deadline, s.
    reply_time : float
        Longest time the instrument takes to begin a reply, s.
    """

    port: str
    baud: Annotated[int, Field(ge=300, le=4_000_000)]
    patience: Annotated[float, Field(gt=0.0, le=60.0)] = 0.3
    reply_time: Annotated[float, Field(gt=0.0, le=60.0)] = 0.02


class StageSettings(Settings):
    """One axis: rig angle = sign · (controller's position − zero).

    Attributes
    ----------
    address : int
        On the line, 1 to 31.
    limits : (float, float)
        Lowest and highest rig angle, degrees, inside the hard limits.
    velocity, acceleration : float
        deg/s, deg/s².
    zero : float
        Controller's position at rig angle 0, degrees.
    sign : int
        1, or −1 where the stage turns the other way.
    """

    address: Annotated[int, Field(ge=1, le=31)]
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


class StagesSettings(PortSettings):
    """The line of the three stages; tolerance in degrees, times in s."""

    driver: str = "smc100"
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 57600
    tolerance: Positive = 0.002
    poll: NotNegative = 0.02
    settle: NotNegative = 0.0
    homing_time: Positive = 60.0
    reset_time: Positive = 10.0
    lamp: StageSettings
    turn: StageSettings
    pitch: StageSettings

    @model_validator(mode="after")
    def _check(self) -> StagesSettings:
        get_driver("stages", self.driver)
        addresses = [getattr(self, name).address for name in AXES]
        if len(set(addresses)) < len(addresses):
            raise ValueError(f"addresses are {addresses}; each stage needs its own")
        return self


class SpectrometerSettings(PortSettings):
    """The spectrometer and what its counts are worth.

    Attributes
    ----------
    electrons_per_count : float
        For the counting noise.
    read_noise : float
        Standard deviation of a dark frame, counts, quantisation included.
    bias : float
        Counts at zero time and no light; they carry no counting noise.
    """

    driver: str = "obp"
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600
    electrons_per_count: Positive = 2.0
    read_noise: NotNegative = 3.0
    bias: NotNegative = 1500.0

    @model_validator(mode="after")
    def _check(self) -> SpectrometerSettings:
        get_driver("spectrometer", self.driver)
        return self


class ReferenceSettings(PortSettings):
    """The reference detector, and the band in which the lamp has to stay.

    Attributes
    ----------
    wavelength : float
        nm, for the meter's own calibration.
    noise : float
        Relative standard deviation of one reading.
    band : float
        Largest relative deviation from the power at the start; outside, the measurement waits.
    wait, every : float
        How long it waits, and how often it looks, s.
    """

    driver: str = "newport1830c"
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600
    reply_time: Annotated[float, Field(gt=0.0, le=60.0)] = 0.5
    wavelength: Annotated[float, Field(ge=200.0, le=2000.0)] = 550.0
    noise: NotNegative = 0.001
    band: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    wait: NotNegative = 600.0
    every: NotNegative = 1.0

    @model_validator(mode="after")
    def _check(self) -> ReferenceSettings:
        get_driver("reference", self.driver)
        return self


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
    largest_zenith : float
        Beyond it the holder's rim shadows the sample, degrees.
    """

    solid_angle: Annotated[float, Field(gt=0.0, lt=6.3)]
    direct: tuple[Angle, Angle, Angle] = (180.0, 90.0, 0.0)
    lamp_shadow: Annotated[float, Field(gt=0.0, lt=90.0)] = 5.0
    largest_zenith: Annotated[float, Field(gt=0.0, lt=90.0)] = 85.0


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
        How far a check point may lie from its first value, relative.
    """

    attempts: Annotated[int, Field(ge=1, le=1000)] = 8
    replug_time: Positive = 60.0
    check_tolerance: Positive = 0.1


class Rig(Settings):
    """A whole rig file."""

    name: str = "goniospectrometer"
    stages: StagesSettings
    spectrometer: SpectrometerSettings
    reference: ReferenceSettings
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
        ports = [self.stages.port, self.spectrometer.port, self.reference.port]
        if len(set(ports)) < len(ports):
            raise ValueError(f"ports are {', '.join(ports)}; each instrument needs its own line")
        return self

    def fingerprint(self) -> str:
        """Everything a measurement depends on, as text; ports and the emulator may change on resume."""
        connection = {"port", "baud", "patience", "reply_time", "poll"}
        parts = dict.fromkeys(("stages", "spectrometer", "reference"), connection)
        return self.model_dump_json(exclude={"emulator": True, "storage": True, "recovery": True, **parts})


def load_rig(path: str | Path) -> Rig:
    """Read a rig file; relative ports are meant from its folder.

    Raises
    ------
    InputError
        As `load_toml`, or axis limits, ports or addresses that contradict each other.
    """
    rig = load_toml(path, Rig)
    folder = Path(path).resolve().parent
    changed = {}
    for name in ("stages", "spectrometer", "reference"):
        part = getattr(rig, name)
        if "://" in part.port:
            raise InputError(f"{path}: {name}.port = {part.port!r}: give the path of a serial port")
        is_windows_port = part.port.upper().startswith("COM")
        place = part.port if is_windows_port else str(folder / part.port)
        changed[name] = part.model_copy(update={"port": place})
    emulator = rig.emulator
    if emulator is not None and emulator.scan:
        changed["emulator"] = emulator.model_copy(update={"scan": str(folder / emulator.scan)})
    return rig.model_copy(update=changed)

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
from typing import Annotated, Any

from pydantic import Field, SerializeAsAny, create_model, model_validator

from clbrdf.errors import InputError
from clbrdf.rig.drivers import axis_of, connection_of, get_driver
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.panel import PanelSettings, load_panel
from clbrdf.rig.stagesettings import AXES, Angle, NotNegative, Positive, StageSettings, StagesSettings
from clbrdf.storage.tomlfile import TomlTable, load_toml

ROLES = ("stages", "spectrometer", "reference")


class SpectrometerSettings(TomlTable):
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


class ReferenceSettings(TomlTable):
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


class GeometrySettings(TomlTable):
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


class StorageSettings(TomlTable):
    """Free space to keep on the disk, MB: below it the measurement stops with its files intact."""

    keep_free: NotNegative = 200.0


class RecoverySettings(TomlTable):
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


class Rig(TomlTable):
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

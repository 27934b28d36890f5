"""Thorlabs Kinesis motors (KDC101, K10CR1, KBD101 and others) through pylablib, one controller an axis.

Source: pylablib, `pylablib.devices.Thorlabs.KinesisMotor`; Thorlabs, Motion Controllers Host-Controller
Communications Protocol (APT).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Annotated, Any

from pydantic import Field

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers import import_extra
from clbrdf.rig.errors import BadReplyError, InstrumentError, NoReplyError, RefusedError, UnpluggedError
from clbrdf.rig.roles import Motion, StageStatus
from clbrdf.storage.tomlfile import TomlTable

ROLES = ("stages",)
EXTRA = "pylablib"
THORLABS = "pylablib.devices.Thorlabs"
MOST_READINGS = 8
BAD = {
    "motion_error": "following error",
    "instr_error": "instrument error",
    "interlock": "interlock open",
    "overtemp": "too warm",
    "volt_supply_fault": "supply voltage",
    "encoder_fault": "encoder fault",
    "overcurrent": "overcurrent",
}
"""Status names of pylablib that mean that a stage does not follow, and what they are."""

LIMITS = {"hw_fw_lim": "positive end of run", "hw_bk_lim": "negative end of run"}


class Axis(TomlTable):
    """One controller.

    Attributes
    ----------
    serial : str
        Its serial number, eight digits.
    stage : str
        "stage" to let pylablib recognise it, or its name, such as "PRM1-Z8" or "K10CR1".
    """

    serial: Annotated[str, Field(pattern=r"^\d{8,}$")]
    stage: str = "stage"


class KinesisStage:
    """One axis; positions in degrees as pylablib scales them."""

    def __init__(self, axis: Axis, context: Context) -> None:
        self.axis = axis
        self.context = context
        self.limits = (-float("inf"), float("inf"))
        self._motor: Any = None

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self._motor is not None

    def open(self) -> None:
        """Connect.

        Raises
        ------
        InstrumentError
            pylablib is missing, or the controller cannot be opened, or it moves no rotary stage.
        """
        self.close()
        thorlabs = import_extra(THORLABS, EXTRA)
        try:
            with warnings.catch_warnings():
                # A stage that pylablib does not recognise is told below, with the mend.
                warnings.simplefilter("ignore", UserWarning)
                self._motor = thorlabs.KinesisMotor(self.axis.serial, scale=self.axis.stage)
            units = self._motor.get_scale_units()
        except Exception as error:  # pylablib and the FTDI libraries raise their own kinds
            raise InstrumentError(f"{self.context.name}: {_why(self.axis.serial, error)}") from error
        if units != "deg":
            self.close()
            raise InstrumentError(
                f"{self.context.name}: the stage at {self.axis.serial} is scaled in {units}, not degrees;"
                ' name it in the rig file, as in stage = "PRM1-Z8"'
            )

    def close(self) -> None:
        """Disconnect."""
        motor, self._motor = self._motor, None
        if motor is not None:
            with suppress(Exception):
                motor.close()

    def identify(self) -> str:
        """Get model and serial number."""
        with self._talking() as motor:
            info = motor.get_device_info()
        return f"{info.model_no} {info.serial_no}"

    def get_status(self) -> StageStatus:
        """Get what the stage is doing."""
        with self._talking() as motor:
            found = set(motor.get_status())
        if "homing" in found:
            motion = Motion.HOMING
        elif found & {"moving_fw", "moving_bk", "jogging_fw", "jogging_bk"}:
            motion = Motion.MOVING
        elif "homed" not in found:
            motion = Motion.NOT_REFERENCED
        else:
            motion = Motion.READY if "enabled" in found else Motion.DISABLED
        return StageStatus(
            motion,
            limit=bool(found & set(LIMITS)) and motion is not Motion.HOMING,
            stalled=bool(found & set(BAD)),
            errors=tuple(text for name, text in {**LIMITS, **BAD}.items() if name in found),
        )

    def get_position(self, tolerance: float) -> float:
        """Measure the position in degrees: the mean of two readings that agree within the tolerance."""
        with self._talking() as motor:
            before = float(motor.get_position())
            for _ in range(MOST_READINGS):
                again = float(motor.get_position())
                if abs(again - before) <= tolerance:
                    return (before + again) / 2.0
                before = again
        raise BadReplyError(f"{self.context.name}: no two positions of {self.axis.serial} agree")

    def start_move(self, target: float) -> None:
        """Set the target in degrees and set off; returns at once."""
        low, high = self.limits
        if not low <= target <= high:
            raise RefusedError(f"{self.context.name}: {target:g}° is outside [{low:g}, {high:g}]°")
        with self._talking() as motor:
            motor.move_to(target)

    def is_unreferenced(self) -> bool:
        """Say True: homing starts from anywhere."""
        return True

    def start_homing(self) -> None:
        """Set off for the home position; returns at once."""
        with self._talking() as motor:
            motor.home(sync=False, force=True)

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Set limits in degrees (kept here: no move beyond them is sent), velocity and acceleration."""
        self.limits = limits
        with self._talking() as motor:
            motor.setup_velocity(max_velocity=velocity, acceleration=acceleration)

    def stop(self) -> None:
        """Stop, with the deceleration that is set."""
        with self._talking() as motor:
            motor.stop(immediate=False, sync=False)

    @contextmanager
    def _talking(self) -> Iterator[Any]:
        if self._motor is None:
            raise UnpluggedError(f"{self.context.name}: {self.axis.serial} is not connected")
        try:
            yield self._motor
        except InstrumentError:
            raise
        except Exception as error:
            text = " ".join(str(error).split()) or type(error).__name__
            if "Timeout" in type(error).__name__ or "timeout" in text.lower():
                self.context.log.add(self.context.name, "no reply", f"{self.axis.serial}: {text}")
                raise NoReplyError(
                    f"{self.context.name}: no reply from {self.axis.serial} ({text})"
                ) from error
            self.close()
            raise UnpluggedError(
                f"{self.context.name}: lost {self.axis.serial} ({text}); plug it in again"
            ) from error


class Kinesis:
    """The axes, each with a controller of its own."""

    def __init__(self, axes: Mapping[str, Axis], context: Context) -> None:
        self.stages = {name: KinesisStage(axis, context) for name, axis in axes.items()}

    @property
    def is_open(self) -> bool:
        """False before `open`, and after a connection was lost."""
        return all(stage.is_open for stage in self.stages.values())

    def open(self) -> None:
        """Connect those that are not."""
        for stage in self.stages.values():
            if not stage.is_open:
                stage.open()

    def close(self) -> None:
        """Disconnect all."""
        for stage in self.stages.values():
            stage.close()

    def identify(self) -> str:
        """Get models and serial numbers."""
        return "; ".join(stage.identify() for stage in self.stages.values())

    def stop(self) -> None:
        """Stop all of them, also where one does not listen."""
        errors = []
        for stage in self.stages.values():
            try:
                stage.stop()
            except InstrumentError as error:
                errors.append(error)
        if errors:
            raise errors[0]


def _why(serial: str, error: Exception) -> str:
    if isinstance(error, InstrumentError):
        return str(error)
    text = " ".join(str(error).split()) or type(error).__name__
    if "not found" in text.lower() or "DEVICE_NOT_FOUND" in text:
        return f"no Kinesis controller {serial} is connected; check the cable and the serial number"
    if "DEVICE_NOT_OPENED" in text or "busy" in text.lower() or "Errno 16" in text:
        return f"controller {serial} is in use by another program; close that one (Kinesis, APT)"
    if "Errno 13" in text or "ermission" in text or "Access denied" in text:
        return (
            f"controller {serial} may not be opened; give this user the right to it (udev rule for 0403:faf0)"
        )
    return f"controller {serial} cannot be opened ({text}); check its serial number and the cable"


def connect(settings: TomlTable, axes: Mapping[str, Axis], context: Context) -> Kinesis:
    """Return the controllers of a rig file."""
    del settings
    return Kinesis(axes, context)


def find() -> list[FoundInstrument]:
    """Return the connected controllers."""
    thorlabs = import_extra(THORLABS, EXTRA)
    try:
        return [FoundInstrument(str(serial), str(what)) for serial, what in thorlabs.list_kinesis_devices()]
    except Exception as error:
        raise InstrumentError(
            f"Kinesis controllers cannot be listed ({' '.join(str(error).split())})"
        ) from error

"""What the rest of the rig asks of an instrument, whoever made it.

A driver class takes its :class:`~clbrdf.rig.transport.Line` (a stage also its address) and fulfils one
of these protocols; `measure`, `calibrate` and the emulator's tests know nothing else of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt


class Motion(Enum):
    """What a stage is doing."""

    NOT_REFERENCED = "not referenced"
    CONFIGURATION = "in configuration"
    HOMING = "homing"
    MOVING = "moving"
    READY = "ready"
    DISABLED = "disabled"


@dataclass(frozen=True)
class StageStatus:
    """State of a stage, and what is wrong with it.

    Attributes
    ----------
    motion : Motion
    limit : bool
        An end-of-run switch is reached.
    stalled : bool
        Following error: the stage does not follow its set point.
    errors : tuple of str
        Every error the controller reports, in words.
    """

    motion: Motion
    limit: bool = False
    stalled: bool = False
    errors: tuple[str, ...] = ()


class Stage(Protocol):
    """One rotary stage; positions are the controller's own, degrees."""

    def identify(self) -> str:
        """Get the firmware's name; raise InstrumentError where another instrument answers."""

    def get_status(self) -> StageStatus:
        """Get what the stage is doing."""

    def get_position(self) -> float:
        """Measure the position in degrees; two readings that agree."""

    def get_predicted_time(self, distance: float) -> float:
        """Get the time a move of `distance` degrees takes, in s."""

    def start_move(self, target: float) -> None:
        """Set the target position in degrees and set off; returns at once."""

    def start_homing(self) -> None:
        """Set off for the home position; returns at once."""

    def reset(self) -> None:
        """Set the controller back to its state after power-on; the reference is lost."""

    def enable(self) -> None:
        """Set a disabled stage ready."""

    def leave_configuration(self) -> None:
        """Set a stage in configuration back to not referenced."""

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Set soft limits in degrees, velocity in deg/s, acceleration in deg/s²."""

    def stop(self) -> None:
        """Stop every stage on the line."""


class Spectrometer(Protocol):
    """A spectrometer that also opens and closes the shutter of the lamp."""

    full_scale: int
    pixels: int
    shortest: float
    longest: float

    def identify(self) -> str:
        """Get the serial number; raise InstrumentError where another instrument answers."""

    def get_wavelength_coefficients(self) -> npt.NDArray[np.float64]:
        """Get the polynomial from pixel number to wavelength in nm, lowest power first."""

    def get_nonlinearity_coefficients(self) -> npt.NDArray[np.float64]:
        """Get the polynomial to divide net counts by, lowest power first; empty where linear."""

    def set_integration_time(self, seconds: float) -> None:
        """Set the integration time in s."""

    def set_shutter(self, is_open: bool) -> None:
        """Set the shutter of the lamp."""

    def forget(self) -> None:
        """Forget every setting made: the instrument was unplugged or reset."""

    def measure_spectrum(self) -> npt.NDArray[np.uint16]:
        """Measure raw counts, (pixels,); the first after any change of time is thrown away."""


class ReferenceDetector(Protocol):
    """A detector that watches the lamp."""

    def identify(self) -> str:
        """Get the units in use; raise InstrumentError where another instrument answers."""

    def configure(self, wavelength: float, noise: float) -> None:
        """Set watts, no echo, the wavelength in nm; `noise` is a reading's relative standard deviation."""

    def measure_power(self) -> float:
        """Measure the power in W; the median of three readings."""

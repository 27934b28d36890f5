"""What the rest of the rig asks of an instrument, whoever made it.

A driver owns its connection: it opens, closes and identifies its instrument, and nothing else in the rig
knows whether that hangs on a serial line, on USB or on a person's hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt

Counts = npt.NDArray[np.uint32]


class RigInstrument(Protocol):
    """What every driver does.

    All methods raise :class:`~clbrdf.rig.errors.InstrumentError` with a message that names the
    instrument and the mend.
    """

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""

    def open(self) -> None:
        """Connect; throw away whatever the instrument still had to say."""

    def close(self) -> None:
        """Disconnect, whatever the state; never raises."""

    def identify(self) -> str:
        """Get what it says it is; raise InstrumentError where another instrument answers."""


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
    doubtful : bool
        A reply before this one was lost, and error bits that are told only once may be lost with it.
    """

    motion: Motion
    limit: bool = False
    stalled: bool = False
    errors: tuple[str, ...] = ()
    doubtful: bool = False


class Stage(Protocol):
    """One rotary stage; positions are the controller's own, degrees."""

    def get_status(self) -> StageStatus:
        """Get what the stage is doing."""

    def get_position(self, tolerance: float) -> float:
        """Measure the position in degrees: the mean of two readings that agree within the tolerance."""

    def start_move(self, target: float) -> None:
        """Set the target position in degrees and set off; returns at once."""

    def is_unreferenced(self) -> bool:
        """Take the next step towards a state from which homing starts; True once it is reached."""

    def start_homing(self) -> None:
        """Set off for the home position; returns at once."""

    def configure(self, limits: tuple[float, float], velocity: float, acceleration: float) -> None:
        """Set soft limits in degrees, velocity in deg/s, acceleration in deg/s²."""


class StageGroup(RigInstrument, Protocol):
    """Stages on one connection."""

    @property
    def stages(self) -> Mapping[str, Stage]:
        """The stages by the name of their axis."""

    def stop(self) -> None:
        """Stop all of them."""


class Spectrometer(RigInstrument, Protocol):
    """A detector of light by wavelength that also opens and closes the shutter of the lamp.

    Attributes
    ----------
    full_scale : int
        Largest count; valid once identified, as are all of these.
    pixels : int
        More than one for a spectrum; as many as filters for a single detector.
    shortest, longest : float
        Integration times it can take, s.
    is_discrete : bool
        Pixels are single wavelengths, not neighbouring parts of a spectrum.
    """

    full_scale: int
    pixels: int
    shortest: float
    longest: float
    is_discrete: bool

    def get_wavelengths(self) -> npt.NDArray[np.float64]:
        """Get the wavelength of each pixel, (pixels,), nm."""

    def get_nonlinearity_coefficients(self) -> npt.NDArray[np.float64]:
        """Get the polynomial to divide net counts by, lowest power first; empty where linear."""

    def get_temperature(self) -> float:
        """Measure the detector's temperature in °C; NaN where the instrument does not tell."""

    def set_integration_time(self, seconds: float) -> None:
        """Set the integration time in s."""

    def set_shutter(self, is_open: bool) -> None:
        """Set the shutter of the lamp; returns at once."""

    def forget(self) -> None:
        """Forget every setting made: the instrument was unplugged or reset."""

    def measure_spectrum(self) -> Counts:
        """Measure one scan's raw counts, (pixels,), begun after this call and after every setting."""


class ReferenceDetector(RigInstrument, Protocol):
    """A detector that watches the lamp."""

    def configure(self, wavelength: float, noise: float) -> None:
        """Set watts and the wavelength in nm; `noise` is a reading's relative standard deviation."""

    def measure_power(self) -> float:
        """Measure the power in W, finite and not negative; the median of three independent readings."""

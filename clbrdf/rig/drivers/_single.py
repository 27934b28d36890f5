"""A single detector in place of a spectrometer: a photodiode, a power meter or a lock-in amplifier.

It sees one wavelength, or as many as there are filters; a wheel or a person puts them in. Readings become
whole counts of a unit that the rig file gives, on top of a bias that keeps darkness from being negative.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal, Protocol

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.rig.connection import Context
from clbrdf.rig.drivers import import_extra
from clbrdf.rig.roles import Counts
from clbrdf.storage.tomlfile import TomlTable

FULL_SCALE = 2**28
TIME = 1.0
"""Stands for the integration time: readings do not grow with it, s."""


class SingleConnection(TomlTable):
    """What a detector needs to stand in for a spectrometer.

    Attributes
    ----------
    wavelengths : tuple of float
        One, or one for each filter, increasing, nm.
    wheel : str
        Serial port of a filter wheel (Thorlabs FW102C, FW212C; extra `pylablib`), filters in its places
        from 1 on; without it a person changes the filters.
    unit : float
        Value of one count, in the detector's own unit (W or V).
    shutter : "manual" or "none"
        Who closes it for a dark reading; "none" where the detector sees only chopped light, and its
        darkness is 0.
    electrons_per_count, read_noise, relative_noise, bias : float
        As for a spectrometer, with values that suit readings: noise of `read_noise` counts and a share
        of the signal.
    """

    wavelengths: Annotated[tuple[Annotated[float, Field(gt=100.0, lt=20_000.0)], ...], Field(min_length=1)]
    wheel: str = ""
    unit: Annotated[float, Field(gt=0.0)] = 1e-11
    shutter: Literal["manual", "none"] = "manual"
    electrons_per_count: Annotated[float, Field(gt=0.0)] = 1e12
    read_noise: Annotated[float, Field(ge=0.0)] = 10.0
    relative_noise: Annotated[float, Field(ge=0.0)] = 0.001
    bias: Annotated[float, Field(ge=0.0)] = 10_000.0

    @model_validator(mode="after")
    def _check_wavelengths(self) -> SingleConnection:
        if list(self.wavelengths) != sorted(set(self.wavelengths)):
            raise ValueError(f"wavelengths are {list(self.wavelengths)}; give them once each, increasing")
        return self


class Meter(Protocol):
    """What reads the light."""

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""

    def open(self) -> None:
        """Connect."""

    def close(self) -> None:
        """Disconnect."""

    def identify(self) -> str:
        """Get what it says it is."""

    def tune(self, wavelength: float) -> None:
        """Set what depends on the wavelength in nm."""

    def read(self) -> float | None:
        """Measure one value in the meter's unit, begun after this call; None where it is overloaded."""


class SingleDetector:
    """A meter as a spectrometer with as many pixels as filters."""

    full_scale = FULL_SCALE
    shortest = longest = TIME
    is_discrete = True

    def __init__(self, meter: Meter, settings: SingleConnection, context: Context) -> None:
        self.meter = meter
        self.settings = settings
        self.pixels = len(settings.wavelengths)
        self._ask = context.ask
        self._place: int | None = None
        self._shutter: bool | None = None
        self._wheel: Callable[[int], object] | None = None
        self._close_wheel: Callable[[], object] = lambda: None

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self.meter.is_open

    def open(self) -> None:
        """Connect the meter and the filter wheel."""
        self.meter.open()
        self._place = None
        if self.settings.wheel:
            thorlabs = import_extra("pylablib.devices.Thorlabs", "pylablib")
            wheel = thorlabs.FW(self.settings.wheel)
            self._wheel, self._close_wheel = wheel.set_position, wheel.close

    def close(self) -> None:
        """Disconnect."""
        self.meter.close()
        self._close_wheel()
        self._wheel, self._close_wheel = None, lambda: None

    def identify(self) -> str:
        """Get what the meter says it is."""
        return self.meter.identify()

    def get_wavelengths(self) -> npt.NDArray[np.float64]:
        """Get the wavelengths of the rig file, nm."""
        return np.array(self.settings.wavelengths)

    def get_nonlinearity_coefficients(self) -> npt.NDArray[np.float64]:
        """Get nothing: such detectors are linear, or correct themselves."""
        return np.empty(0)

    def get_temperature(self) -> float:
        """Get NaN: it does not tell."""
        return float("nan")

    def set_integration_time(self, seconds: float) -> None:
        """Do nothing: readings do not grow with time."""

    def set_shutter(self, is_open: bool) -> None:
        """Ask for the shutter, where a person moves it."""
        if self.settings.shutter == "manual" and is_open != self._shutter:
            self._ask(f"{'open' if is_open else 'close'} the shutter, then press Enter")
        self._shutter = is_open

    def forget(self) -> None:
        """Forget the filter and the shutter."""
        self._place, self._shutter = None, None

    def measure_spectrum(self) -> Counts:
        """Measure one reading for each filter, (pixels,) counts."""
        return np.array([self._counts(place) for place in range(self.pixels)], dtype=np.uint32)

    def _counts(self, place: int) -> int:
        wavelength = self.settings.wavelengths[place]
        if place != self._place:
            if self.pixels > 1 and self._wheel is not None:
                self._wheel(place + 1)
            elif self.pixels > 1:
                self._ask(f"put in the filter for {wavelength:g} nm, then press Enter")
            self.meter.tune(wavelength)
            self._place = place
        if self.settings.shutter == "none" and self._shutter is False:
            return round(self.settings.bias)
        value = self.meter.read()
        if value is None:
            return FULL_SCALE
        return int(min(max(round(value / self.settings.unit + self.settings.bias), 0), FULL_SCALE))

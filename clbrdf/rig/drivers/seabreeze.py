"""Ocean Insight (Ocean Optics) USB spectrometers through seabreeze.

Most of them integrate all the time and give the spectrum that ends next: the first one after any pause
is thrown away, so that what is measured began after it was asked for. The shutter is the spectrometer's
own, or the lamp on its strobe output.

Source: seabreeze, `seabreeze.spectrometers`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers import import_extra
from clbrdf.rig.errors import BadReplyError, InstrumentError, UnpluggedError
from clbrdf.rig.roles import Counts
from clbrdf.storage.tomlfile import TomlTable

ROLES = ("spectrometer",)
EXTRA = "seabreeze"
MODULE = "seabreeze.spectrometers"
NORMAL = 0
"""Trigger mode: free running, on demand."""

BACK_TO_BACK = 0.002
"""A spectrum asked for so soon after the last one follows it without a gap, s."""


class Connection(TomlTable):
    """A spectrometer on USB.

    Attributes
    ----------
    serial : str
        Its serial number; "" for the only one that is connected.
    shutter : "strobe", "shutter" or "manual"
        The lamp on the strobe output, the spectrometer's own shutter, or a person.
    """

    serial: str = ""
    shutter: Literal["strobe", "shutter", "manual"] = "strobe"


class SeaBreezeSpectrometer:
    """The spectrometer."""

    is_discrete = False

    def __init__(self, settings: Connection, context: Context) -> None:
        self.settings = settings
        self.context = context
        self.full_scale, self.pixels = 65535, 0
        self.shortest, self.longest = 1e-3, 10.0
        self._device: Any = None
        self._time: float | None = None
        self._shutter: bool | None = None
        self._is_set = False
        self._ended = -1.0

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self._device is not None

    def open(self) -> None:
        """Connect.

        Raises
        ------
        InstrumentError
            seabreeze is missing, no such spectrometer is there, it is in use, or there is no right to it.
        """
        self.close()
        library = import_extra(MODULE, EXTRA)
        try:
            found = list(library.list_devices())
            if self.settings.serial:
                found = [device for device in found if device.serial_number == self.settings.serial]
            if not found:
                which = f" with serial number {self.settings.serial}" if self.settings.serial else ""
                raise InstrumentError(
                    f"no Ocean spectrometer{which} is connected, or none that may be opened; check the cable"
                    " and the serial number, and run seabreeze_os_setup once for the right to use it"
                )
            if len(found) > 1:
                names = ", ".join(device.serial_number for device in found)
                raise InstrumentError(
                    f"several spectrometers are connected ({names}); give spectrometer.serial"
                )
            device = library.Spectrometer(found[0])
        except InstrumentError as error:
            raise InstrumentError(f"{self.context.name}: {error}") from error
        except Exception as error:  # both backends raise their own kinds
            raise InstrumentError(f"{self.context.name}: {_why(error)}") from error
        self._device = device
        self.forget()
        self.full_scale, self.pixels = int(device.max_intensity), int(device.pixels)
        low, high = device.integration_time_micros_limits
        self.shortest, self.longest = low / 1e6, high / 1e6

    def close(self) -> None:
        """Disconnect."""
        device, self._device = self._device, None
        if device is not None:
            with suppress(Exception):
                device.close()

    def identify(self) -> str:
        """Get model and serial number."""
        with self._talking() as device:
            return f"{device.model} {device.serial_number}"

    def get_wavelengths(self) -> npt.NDArray[np.float64]:
        """Get the wavelength of each pixel, (pixels,), nm."""
        with self._talking() as device:
            return np.asarray(device.wavelengths(), dtype=np.float64)

    def get_nonlinearity_coefficients(self) -> npt.NDArray[np.float64]:
        """Get the polynomial to divide net counts by, lowest power first; empty where none is stored."""
        with self._talking() as device:
            feature = _feature(device, "nonlinearity_coefficients")
            values = [] if feature is None else feature.get_nonlinearity_coefficients()
        return np.asarray(values, dtype=np.float64)

    def get_temperature(self) -> float:
        """Measure the detector's temperature in °C; NaN where the instrument does not tell."""
        with self._talking() as device:
            cooler = _feature(device, "thermo_electric")
            if cooler is not None:
                return float(cooler.read_temperature_degrees_celsius())
            sensor = _feature(device, "temperature")
            return float("nan") if sensor is None else float(sensor.read_temperature(0))

    def set_integration_time(self, seconds: float) -> None:
        """Set the integration time in s, in whole µs."""
        if not self.shortest <= seconds <= self.longest:
            raise InstrumentError(
                f"{self.context.name}: {seconds:g} s is outside {self.shortest:g} to {self.longest:g} s"
            )
        if seconds != self._time:
            with self._talking() as device:
                device.integration_time_micros(round(seconds * 1e6))
            self._time, self._ended = seconds, -1.0

    def set_shutter(self, is_open: bool) -> None:
        """Open or close the shutter, or switch the lamp on the strobe output.

        Raises
        ------
        InstrumentError
            The spectrometer has no such output.
        """
        if is_open == self._shutter:
            return
        if self.settings.shutter == "manual":
            self.context.ask(f"{'open' if is_open else 'close'} the shutter, then press Enter")
        else:
            name = "strobe_lamp" if self.settings.shutter == "strobe" else "shutter"
            with self._talking() as device:
                feature = _feature(device, name)
                if feature is None:
                    raise InstrumentError(
                        f"{self.context.name}: {device.model} has no {self.settings.shutter} output; give"
                        ' another spectrometer.shutter, such as "manual"'
                    )
                if name == "strobe_lamp":
                    feature.enable_lamp(is_open)
                else:
                    feature.set_shutter_open(is_open)
        self._shutter, self._ended = is_open, -1.0

    def forget(self) -> None:
        """Forget every setting made."""
        self._time, self._shutter, self._is_set, self._ended = None, None, False, -1.0

    def measure_spectrum(self) -> Counts:
        """Measure raw counts, (pixels,): no dark and no nonlinearity correction, no averaging, no boxcar."""
        with self._talking() as device:
            if not self._is_set:
                device.trigger_mode(NORMAL)
                processing = _feature(device, "spectrum_processing")
                if processing is not None:
                    processing.set_scans_to_average(1)
                    processing.set_boxcar_width(0)
                self._is_set = True
            if time.monotonic() - self._ended > BACK_TO_BACK:
                device.intensities(correct_dark_counts=False, correct_nonlinearity=False)
            values = device.intensities(correct_dark_counts=False, correct_nonlinearity=False)
            self._ended = time.monotonic()
        counts = np.rint(np.asarray(values, dtype=np.float64))
        if counts.shape != (self.pixels,) or not np.isfinite(counts).all() or counts.min() < 0:
            raise BadReplyError(f"{self.context.name}: a spectrum of {counts.size} pixels that cannot be")
        return counts.astype(np.uint32)

    @contextmanager
    def _talking(self) -> Iterator[Any]:
        if self._device is None:
            raise UnpluggedError(f"{self.context.name}: the spectrometer is not connected")
        try:
            yield self._device
        except InstrumentError:
            raise
        except Exception as error:
            text = " ".join(str(error).split()) or type(error).__name__
            self.close()
            raise UnpluggedError(
                f"{self.context.name}: lost the spectrometer ({text}); plug it in again"
            ) from error


def _feature(device: Any, name: str) -> Any:
    found = device.features.get(name) or []
    return found[0] if found else None


def _why(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if "Errno 13" in text or "ccess denied" in text or "ermission" in text:
        return "the spectrometer may not be opened; run seabreeze_os_setup once, then plug it in again"
    if "busy" in text.lower() or "already opened" in text or "Errno 16" in text:
        return "the spectrometer is in use by another program; close that one"
    return f"the spectrometer cannot be opened ({text}); unplug it and plug it in again"


def connect(settings: Connection, context: Context) -> SeaBreezeSpectrometer:
    """Return the spectrometer of a rig file."""
    return SeaBreezeSpectrometer(settings, context)


def find() -> list[FoundInstrument]:
    """Return the connected spectrometers."""
    library = import_extra(MODULE, EXTRA)
    try:
        return [FoundInstrument(device.serial_number, str(device.model)) for device in library.list_devices()]
    except Exception as error:
        raise InstrumentError(_why(error)) from error

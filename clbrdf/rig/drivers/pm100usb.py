"""Thorlabs PM100USB power meter through pymeasure: the reference detector, or the detector itself.

Source: pymeasure, `pymeasure.instruments.thorlabs.ThorlabsPM100USB`; Thorlabs, PM100D manual, SCPI commands.
"""

from __future__ import annotations

import math
from statistics import median

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers._single import SingleConnection, SingleDetector
from clbrdf.rig.drivers._visa import EXTRA as EXTRA
from clbrdf.rig.drivers._visa import VisaConnection, VisaInstrument, find_resources
from clbrdf.rig.errors import BadReplyError, InstrumentError

ROLES = ("reference", "spectrometer")
MOST_WATTS = 100.0
"""No sensor of it reads more; the meter answers 9.9E37 where it is over its range."""


class Connection(VisaConnection):
    """Its VISA resource."""


class DetectorConnection(VisaConnection, SingleConnection):
    """As the detector: its VISA resource and the wavelengths."""


CONNECTIONS = {"spectrometer": DetectorConnection}


class Pm100Usb:
    """The power meter."""

    def __init__(self, settings: VisaConnection, context: Context) -> None:
        self.visa = VisaInstrument("pymeasure.instruments.thorlabs", "ThorlabsPM100USB", settings, context)
        self.name = context.name
        self._wavelength = 0.0

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self.visa.is_open

    def open(self) -> None:
        """Connect."""
        self.visa.open()

    def close(self) -> None:
        """Disconnect."""
        self.visa.close()

    def identify(self) -> str:
        """Get its identity and its sensor's.

        Raises
        ------
        InstrumentError
            Another instrument answers, or its sensor measures no power.
        """
        text = self.visa.identify("PM100")
        with self.visa.talking() as meter:
            if not meter.is_power_sensor:
                raise InstrumentError(f"{self.name}: sensor {meter.sensor_name} measures no power; change it")
            return f"{text}, sensor {meter.sensor_name}"

    def configure(self, wavelength: float, noise: float) -> None:
        """Set watts, automatic range, and the wavelength in nm; `noise` is not used."""
        del noise
        self.tune(wavelength)

    def tune(self, wavelength: float) -> None:
        """Set watts, automatic range, one sample a reading, and the wavelength in nm; read that back."""
        with self.visa.talking() as meter:
            meter.write("SENS:POW:UNIT W")
            meter.write("SENS:POW:RANG:AUTO ON")
            meter.write("SENS:CORR:LOSS:INP:MAGN 0")
            meter.write("SENS:AVER:COUN 1")
            if meter.wavelength_settable:
                meter.wavelength = wavelength
                found = float(meter.wavelength)
                if abs(found - wavelength) > 0.5:
                    raise InstrumentError(
                        f"{self.name}: the sensor's wavelength stays {found:g} nm, not {wavelength:g} nm; it"
                        f" takes {meter.wavelength_min:g} to {meter.wavelength_max:g} nm"
                    )
        self._wavelength = wavelength

    def read(self) -> float | None:
        """Measure the power in W; None over its range."""
        with self.visa.talking() as meter:
            value = float(meter.power)
        if math.isnan(value):
            raise BadReplyError(f"{self.name}: a power that is no number")
        return None if abs(value) > MOST_WATTS else value

    def measure_power(self) -> float:
        """Measure the power in W, at least 0: the median of three."""
        values = [self.read() for _ in range(3)]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            raise InstrumentError(f"{self.name}: the power meter is over its range; put a filter before it")
        return max(0.0, median(known))


def connect(settings: VisaConnection, context: Context) -> Pm100Usb | SingleDetector:
    """Return the meter, or the meter as the detector."""
    meter = Pm100Usb(settings, context)
    return SingleDetector(meter, settings, context) if isinstance(settings, DetectorConnection) else meter


def find() -> list[FoundInstrument]:
    """Return the connected ones."""
    return find_resources(lambda name: "0x1313" in name.lower() or "::4883::" in name)

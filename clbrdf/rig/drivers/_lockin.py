"""What the lock-in amplifiers SR830 and SR860 have in common, with a photodiode and a chopper."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import Field

from clbrdf.rig.connection import Context
from clbrdf.rig.drivers._single import SingleConnection
from clbrdf.rig.drivers._visa import VisaConnection, VisaInstrument


class LockInConnection(VisaConnection, SingleConnection):
    """A lock-in amplifier.

    Attributes
    ----------
    output : "x" or "magnitude"
        X follows the phase that is set; the magnitude never falls below the noise.
    settle : float
        Time constants to wait before a reading.
    """

    unit: Annotated[float, Field(gt=0.0)] = 1e-9
    shutter: Literal["manual", "none"] = "none"
    output: Literal["x", "magnitude"] = "x"
    settle: Annotated[float, Field(ge=1.0, le=100.0)] = 7.0


class LockIn:
    """The amplifier as a meter of volts.

    Parameters
    ----------
    name : str
        Of pymeasure's class, which is also what the instrument calls itself.
    settings : LockInConnection
    context : Context
    is_overloaded : callable
        Tells it from pymeasure's instrument.
    """

    def __init__(
        self,
        name: str,
        settings: LockInConnection,
        context: Context,
        is_overloaded: Callable[[Any], bool],
    ) -> None:
        self.visa = VisaInstrument("pymeasure.instruments.srs", name, settings, context)
        self.name = name
        self.settings = settings
        self._is_overloaded = is_overloaded

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
        """Get its identity; raise InstrumentError where another instrument answers."""
        return self.visa.identify(self.name)

    def tune(self, wavelength: float) -> None:
        """Do nothing: the photodiode's response cancels in the ratio to the incident power."""

    def read(self) -> float | None:
        """Measure volts after the filter has settled; None where an input or output is overloaded."""
        with self.visa.talking() as amplifier:
            time.sleep(self.settings.settle * float(amplifier.time_constant))
            # What the status latched before this reading is thrown away.
            self._is_overloaded(amplifier)
            value = float(getattr(amplifier, self.settings.output))
            return None if self._is_overloaded(amplifier) else value

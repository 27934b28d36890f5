"""Light at a pose of the axes, for what is done before a scan: net counts per second and watt."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.exposure import Exposer, ladder
from clbrdf.rig.instruments import Instruments
from clbrdf.rig.lampwatch import LampWatch
from clbrdf.rig.planfile import Plan
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE, count_variance

DARK_TIME = 300.0
"""A dark spectrum serves this long, s."""


@dataclass(frozen=True, eq=False)
class PoseLight:
    """What was measured at a pose.

    Attributes
    ----------
    axes : tuple of float
        Rig angles read back, degrees.
    spectrum : (P,) float64
        Net counts per second and watt of reference power.
    variance : (P,) float64
    reading : float
        Relative standard uncertainty of the reference power, common to all pixels.
    """

    axes: tuple[float, ...]
    spectrum: npt.NDArray[np.float64]
    variance: npt.NDArray[np.float64]
    reading: float

    def total(self) -> tuple[float, float]:
        """Return the sum over the pixels and its standard uncertainty."""
        value = float(self.spectrum.sum())
        return value, float(np.hypot(np.sqrt(self.variance.sum()), value * self.reading))


class LightMeter:
    """Measures light with connected and homed instruments.

    Parameters
    ----------
    instruments : Instruments
    log : EventLog
    check : callable
        Called between exchanges; raises `StoppedError` where the user wants to stop.
    longest_time : float
        Longest integration time, s.
    """

    def __init__(
        self,
        instruments: Instruments,
        log: EventLog,
        check: Callable[[], None],
        longest_time: float = 1.0,
    ) -> None:
        self.instruments = instruments
        spectrometer = instruments.spectrometer
        plan = Plan.model_validate({"theta_i": 0, "theta_r": 0, "longest_time": longest_time})
        times = ladder(plan, spectrometer.shortest, spectrometer.longest)
        everywhere = slice(0, spectrometer.pixels)
        settings = instruments.rig.spectrometer
        self.exposer = Exposer(spectrometer, settings, times, 1, everywhere, log, check)
        self.lamp = LampWatch(instruments.reference, instruments.rig.reference, log, check, None)
        self._darks: dict[float, tuple[float, npt.NDArray[np.float64]]] = {}
        self._start = times[0]

    def measure(self, axes: Sequence[float]) -> PoseLight:
        """Move to rig angles (lamp, turn, pitch) in degrees and measure the light there.

        Raises
        ------
        InstrumentError
            A fault, or a spectrum that is saturated at the shortest time.
        """
        positions = self.instruments.stages.move(axes)
        time.sleep(self.instruments.rig.stages.settle)
        self.exposer.set_shutter(True)
        before = self.lamp.wait()
        self.lamp.accept(before)
        exposure = self.exposer.expose(self._start, True)
        power = (before + self.lamp.measure()) / 2.0
        if exposure.saturated:
            raise UnmendedError("the light saturates the spectrometer at its shortest time; put in a filter")
        self._start = exposure.seconds
        dark = self._dark(exposure.seconds)
        counts = exposure.counts.astype(np.float64)
        settings = self.instruments.rig.spectrometer
        scale = 1.0 / exposure.seconds / power
        variance = (count_variance(counts, settings) + count_variance(dark, settings)) * scale**2
        reading = self.instruments.rig.reference.noise * float(np.sqrt(MEDIAN_OF_THREE / 2.0))
        return PoseLight(positions, (counts - dark) * scale, variance, reading)

    def _dark(self, seconds: float) -> npt.NDArray[np.float64]:
        known = self._darks.get(seconds)
        if known is None or time.monotonic() - known[0] > DARK_TIME:
            self.exposer.set_shutter(False)
            counts = self.exposer.take(seconds).counts.astype(np.float64)
            self.exposer.set_shutter(True)
            known = self._darks[seconds] = (time.monotonic(), counts)
        return known[1]

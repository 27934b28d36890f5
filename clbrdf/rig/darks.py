"""Dark spectra: one for each integration time, as long as it is fresh enough."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError
from clbrdf.rig.eventlog import now_text
from clbrdf.rig.exposure import Exposer, Exposure
from clbrdf.rig.planfile import Plan
from clbrdf.rig.roles import Spectrometer
from clbrdf.rig.row import DARK, NO_ROW, Row
from clbrdf.rig.store import Store


@dataclass
class Dark:
    """A dark row, how many rows have used it, when and how warm it was taken."""

    row: int
    used: int
    began: float
    temperature: float


class Darks:
    """Takes dark spectra where the last one is too old, too cold, too warm, or used too often.

    Parameters
    ----------
    spectrometer : Spectrometer
    exposer : Exposer
    plan : Plan
        How long a dark serves.
    store : Store
        Where they are committed.
    check : callable
        Called between exposures; raises `StoppedError` where the user wants to stop.
    """

    def __init__(
        self,
        spectrometer: Spectrometer,
        exposer: Exposer,
        plan: Plan,
        store: Store,
        check: Callable[[], None],
    ) -> None:
        self.spectrometer = spectrometer
        self.exposer = exposer
        self.plan = plan
        self.store = store
        self.check = check
        self._darks: dict[float, Dark] = {}

    def forget(self) -> None:
        """Let none of them serve any longer."""
        self._darks.clear()

    def row_for(
        self, exposure: Exposure, axes: npt.NDArray[np.float64], power: float, temperature: float
    ) -> int:
        """Return the row of a dark spectrum of this integration time that is fresh enough."""
        fresh = self._darks.get(exposure.seconds)
        if fresh is None or not self._is_fresh(fresh, temperature):
            self.exposer.set_shutter(False)
            self.check()
            dark = self.exposer.take(exposure.seconds)
            now = self.spectrometer.get_temperature()
            self.exposer.set_shutter(True)
            if dark.saturated:
                raise UnmendedError(
                    f"spectrometer: a dark spectrum of {dark.seconds:g} s is saturated; see whether the"
                    " shutter closes, or plan a shorter longest_time"
                )
            row = Row(
                DARK,
                NO_ROW,
                now_text(),
                axes,
                power,
                dark.seconds,
                NO_ROW,
                NO_ROW,
                0,
                dark.counts,
                scans=dark.scans,
                temperature=now,
            )
            place = self.store.append(row)
            fresh = self._darks[exposure.seconds] = Dark(place, 0, time.monotonic(), now)
        fresh.used += 1
        return fresh.row

    def _is_fresh(self, dark: Dark, temperature: float) -> bool:
        """Say whether a dark still serves: by age, by the detector's temperature, by rows if so planned."""
        if time.monotonic() - dark.began > self.plan.dark_time:
            return False
        if abs(temperature - dark.temperature) > self.plan.dark_drift:  # False where either is NaN
            return False
        return self.plan.dark_every is None or dark.used < self.plan.dark_every

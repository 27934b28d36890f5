"""The lamp's power by the reference detector: in its band, or waited for, or a person has to look."""

from __future__ import annotations

import time
from collections.abc import Callable

from clbrdf.rig.errors import OutOfBandError, UnmendedError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.rigfile import ReferenceSettings
from clbrdf.rig.roles import ReferenceDetector


class LampWatch:
    """Measures the reference power and keeps it in a band around that at the start.

    Parameters
    ----------
    detector : ReferenceDetector
    settings : ReferenceSettings
        Band, and how long to wait for the lamp.
    log : EventLog
    check : callable
        Called while waiting; raises `StoppedError` where the user wants to stop.
    base : float or None
        Power at the start, W; None before it is known.
    """

    def __init__(
        self,
        detector: ReferenceDetector,
        settings: ReferenceSettings,
        log: EventLog,
        check: Callable[[], None],
        base: float | None,
    ) -> None:
        self.detector = detector
        self.settings = settings
        self.log = log
        self.check = check
        self.base = base

    def accept(self, power: float) -> None:
        """Take a power for that at the start, where there is none yet."""
        if self.base is None:
            self.base = power

    def measure(self) -> float:
        """Measure the power in W.

        Raises
        ------
        OutOfBandError
            It is out of its band, or there is no light at all.
        """
        power = self.detector.measure_power()
        what = self._what_is_wrong(power)
        if what:
            self.log.add("reference", "lamp out of band", what)
            raise OutOfBandError(f"reference: the lamp gives {what}")
        return power

    def wait(self) -> float:
        """Measure the power in W; out of its band, wait until it is back.

        Raises
        ------
        UnmendedError
            It does not come back in the time the rig file gives it.
        """
        deadline = time.monotonic() + self.settings.wait
        is_waiting = False
        while True:
            power = self.detector.measure_power()
            what = self._what_is_wrong(power)
            if not what:
                if is_waiting:
                    self.log.add("reference", "lamp back", f"{power:.4g} W")
                return power
            if not is_waiting:
                self.log.add(
                    "reference", "lamp out of band", f"{what}; waiting up to {self.settings.wait:g} s"
                )
                is_waiting = True
            if time.monotonic() > deadline:
                raise UnmendedError(f"reference: the lamp gives {what}; see to the lamp")
            self.check()
            time.sleep(self.settings.every)

    def _what_is_wrong(self, power: float) -> str:
        if power < self.settings.least:
            return f"{power:.3g} W, less than reference.least ({self.settings.least:g} W): no light"
        if self.base is not None and abs(power / self.base - 1.0) > self.settings.band:
            return (
                f"{power:.4g} W, more than {self.settings.band:.1%} from the {self.base:.4g} W at the start"
            )
        return ""

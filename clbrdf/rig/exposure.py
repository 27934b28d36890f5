"""Exposures: a ladder of integration times, scans summed, a shutter that has to settle.

The rung is chosen on which a direction neither saturates nor starves. Where a plan asks for it, longer
rungs are measured as well (HDR), saturated where it is bright: each pixel then takes the longest time at
which it is not, and the pixels that two rungs share check them against each other.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import SpectrometerSettings
from clbrdf.rig.roles import Counts, Spectrometer
from clbrdf.rig.uncertainty import count_variance

STEP = 4.0
"""Ratio of neighbouring rungs: the best one fills a quarter to all of the usable range."""

FILL = 0.8
"""Share of the usable range that a longer time may be expected to reach."""

PLATEAU = 24
"""Neighbouring pixels at one and the same highest count: the detector clips below its full scale."""

MOST_FLASHES = 3
"""Spectra in a row that saturate at the shortest time before the light is too bright: a flash passes."""

MOST_UNSETTLED = 12
"""Scans after which a shutter is taken to be stuck half-way, or the lamp to flicker."""

AGREE_SIGMA, AGREE_RELATIVE = 5.0, 0.005
"""Two scans agree within this many standard deviations of their means, and this share of the signal."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """The sum of the scans of one integration time.

    Attributes
    ----------
    counts : (P,) uint32
        A pixel at which a scan was saturated holds `scans` times full scale.
    seconds : float
        Integration time of one scan.
    scans : int
    saturated : bool
        A pixel of interest was.
    """

    counts: Counts
    seconds: float
    scans: int
    saturated: bool


def ladder(plan: Plan, shortest: float, longest: float) -> tuple[float, ...]:
    """Integration times to choose from, s, increasing; whole µs.

    A fixed time is the longest rung, the shorter ones serve when it saturates. A detector that knows one
    time only (`shortest` equals `longest`) has one rung.
    """
    if shortest == longest:
        return (shortest,)
    if plan.integration_time == "auto":
        low, top = max(plan.shortest_time, shortest), min(plan.longest_time, longest)
        times = [low * STEP**k for k in range(64) if low * STEP**k <= top * (1.0 + 1e-9)] or [low]
    else:
        top = plan.integration_time
        times = [top / STEP**k for k in range(64) if top / STEP**k >= shortest][::-1] or [top]
    return tuple(round(t * 1e6) / 1e6 for t in times)


class Exposer:
    """Takes exposures with one spectrometer.

    Parameters
    ----------
    spectrometer : Spectrometer
    settings : SpectrometerSettings
        Noise, full scale, shutter.
    times : tuple of float
        The ladder, s.
    scans : int
        To sum for each exposure.
    window : slice
        Pixels that count.
    log : EventLog
    check : callable
        Called between scans; raises `StoppedError` where the user wants to stop.
    """

    def __init__(
        self,
        spectrometer: Spectrometer,
        settings: SpectrometerSettings,
        times: tuple[float, ...],
        scans: int,
        window: slice,
        log: EventLog,
        check: Callable[[], None],
    ) -> None:
        self.spectrometer = spectrometer
        self.settings = settings
        self.times = times
        self.scans = scans
        self.window = window
        self.log = log
        self.check = check
        self.limit = saturation_limit(spectrometer.full_scale, settings)
        self._is_open: bool | None = None
        self._is_settled = False

    def forget(self) -> None:
        """Forget the shutter's state: the instrument was reset."""
        self._is_open, self._is_settled = None, False

    def set_shutter(self, is_open: bool) -> None:
        """Open or close the shutter and wait until it has moved."""
        if is_open != self._is_open:
            self.spectrometer.set_shutter(is_open)
            self._is_open, self._is_settled = is_open, False
            time.sleep(self.settings.shutter_time)

    def take(self, seconds: float) -> Exposure:
        """Sum the scans of one integration time.

        Raises
        ------
        UnmendedError
            Scans after a move of the shutter do not come to rest.
        """
        self.spectrometer.set_integration_time(seconds)
        scan = self._first_scan()
        total = np.zeros(scan.shape, np.uint64)
        full = np.zeros(scan.shape, bool)
        for place in range(self.scans):
            if place:
                self.check()
                scan = self.spectrometer.measure_spectrum()
            full |= saturated(scan, self.limit)
            total += scan
        # A sum does not show that one scan of it was saturated: the pixel is marked as full.
        total[full] = self.scans * max(self.limit, self.spectrometer.full_scale)
        return Exposure(total.astype(np.uint32), seconds, self.scans, bool(full[self.window].any()))

    def _first_scan(self) -> Counts:
        """Return the first scan that counts: after a move of the shutter, one like the scan before."""
        scan = self.spectrometer.measure_spectrum()
        if self._is_settled:
            return scan
        for _ in range(MOST_UNSETTLED):
            self.check()
            before, scan = scan, self.spectrometer.measure_spectrum()
            if self._agree(before, scan):
                self._is_settled = True
                return scan
            self.log.add("spectrometer", "not settled", "two scans after a move of the shutter differ")
        raise UnmendedError(
            f"spectrometer: {MOST_UNSETTLED} scans after a move of the shutter do not settle; make"
            f" spectrometer.shutter_time longer (now {self.settings.shutter_time:g} s), or look at the lamp"
        )

    def _agree(self, one: Counts, other: Counts) -> bool:
        a, b = (np.asarray(scan[self.window], dtype=np.float64) for scan in (one, other))
        if (a >= self.limit).any() and (b >= self.limit).any():
            return True
        variance = (count_variance(a, self.settings) + count_variance(b, self.settings)).sum() / a.size**2
        signal = max(0.0, float(b.mean()) - self.settings.bias)
        allowed = AGREE_SIGMA * float(np.sqrt(variance)) + AGREE_RELATIVE * signal + 1.0
        return abs(float(a.mean() - b.mean())) <= allowed

    def expose(self, start: float, may_grow: bool) -> Exposure:
        """Take an exposure, shorter while it saturates, longer (if it may grow) while there is room.

        `start` is where to begin, s: the rung nearest to it; never longer than that if it may not grow.
        """
        times = self.times
        rung = int(np.argmin([abs(np.log(t / start)) for t in times]))
        at_shortest = 0
        while True:
            self.check()
            exposure = self.take(times[rung])
            if exposure.saturated and rung > 0:
                self.log.add(
                    "spectrometer", "saturation", f"at {times[rung]:g} s; repeated with a shorter time"
                )
                rung, may_grow = rung - 1, False
                continue
            if exposure.saturated:
                at_shortest += 1
                if at_shortest == MOST_FLASHES:
                    return exposure
                self.log.add("spectrometer", "saturation", f"at {times[0]:g} s, the shortest time; repeated")
                continue
            counts = exposure.counts / exposure.scans
            peak, floor = float(counts[self.window].max()), float(counts.min())
            longer = _longest_fitting(times, rung, peak, floor, self.limit)
            if not may_grow or longer == rung:
                return exposure
            rung = longer

    def longer(self, exposure: Exposure, count: int) -> list[Exposure]:
        """Take up to `count` exposures on the rungs above one, the shortest first."""
        rung = self.times.index(exposure.seconds)
        return [self.take(seconds) for seconds in self.times[rung + 1 : rung + 1 + count]]


def saturation_limit(full_scale: int, settings: SpectrometerSettings) -> int:
    """Return the count from which a scan is taken for saturated."""
    return int(settings.margin * min(full_scale, settings.full_scale or full_scale))


def saturated(scan: Counts, limit: int) -> npt.NDArray[np.bool_]:
    """Say which pixels (P,) are at full scale, or on a plateau where the detector clips below it.

    Noise never gives many neighbours the same highest count; a well or an amplifier that is full does.
    """
    full = scan >= limit
    top = scan.max(initial=0)
    if not full.any() and top > limit // 2:
        same = np.concatenate([[False], scan == top, [False]])
        edges = np.nonzero(same[1:] != same[:-1])[0]
        runs = edges[1::2] - edges[::2]
        if runs.max(initial=0) >= PLATEAU:
            full = full | (scan == top)
    return np.asarray(full)


def _longest_fitting(times: tuple[float, ...], rung: int, peak: float, floor: float, limit: float) -> int:
    """Return the highest rung at which the peak is expected below `FILL` of what is usable.

    The floor of the spectrum stands for bias and dark level; one rung at a time beyond a factor of 16,
    where a weak signal says little.
    """
    best = rung
    for k in range(rung + 1, min(rung + 3, len(times))):
        expected = floor + (peak - floor + 2.0) * times[k] / times[rung]
        if expected < FILL * limit:
            best = k
    return best

"""Integration times: a ladder of them, and the rung on which a direction neither saturates nor starves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.planfile import Plan
from clbrdf.rig.roles import Spectrometer

STEP = 4.0
"""Ratio of neighbouring rungs: the best one fills a quarter to all of the usable range."""

FILL = 0.8
"""Share of full scale that a longer time may be expected to reach."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """Raw counts (P,), the integration time in s, whether a pixel of interest is at full scale."""

    counts: npt.NDArray[np.uint16]
    seconds: float
    saturated: bool


def ladder(plan: Plan, shortest: float) -> tuple[float, ...]:
    """Integration times to choose from, s, increasing; whole µs.

    A fixed time is the longest rung, the shorter ones serve when it saturates.
    """
    if plan.integration_time == "auto":
        low, top = max(plan.shortest_time, shortest), plan.longest_time
        times = [low * STEP**k for k in range(64) if low * STEP**k <= top * (1.0 + 1e-9)]
    else:
        longest = plan.integration_time
        times = [longest / STEP**k for k in range(64) if longest / STEP**k >= shortest][::-1] or [longest]
    return tuple(round(t * 1e6) / 1e6 for t in times)


def expose(
    spectrometer: Spectrometer,
    times: tuple[float, ...],
    start: float,
    window: slice,
    is_automatic: bool,
    saturated: Callable[[float], None],
) -> Exposure:
    """Measure a spectrum, shorter while it saturates, longer (if automatic) while there is room.

    Parameters
    ----------
    spectrometer : Spectrometer
    times : tuple of float
        The ladder, s.
    start : float
        Where to begin, s: the rung nearest to it.
    window : slice
        Pixels that count.
    is_automatic : bool
        False: never longer than `start`.
    saturated : callable
        Told each time a spectrum is thrown away for saturation.
    """
    rung = int(np.argmin([abs(np.log(t / start)) for t in times]))
    may_grow = is_automatic
    while True:
        spectrometer.set_integration_time(times[rung])
        counts = spectrometer.measure_spectrum()
        peak = int(counts[window].max())
        if peak >= spectrometer.full_scale:
            if rung == 0:
                return Exposure(counts, times[rung], True)
            saturated(times[rung])
            rung, may_grow = rung - 1, False
            continue
        longer = _longest_fitting(times, rung, peak, int(counts.min()), spectrometer.full_scale)
        if not may_grow or longer == rung:
            return Exposure(counts, times[rung], False)
        rung = longer


def _longest_fitting(times: tuple[float, ...], rung: int, peak: int, floor: int, full_scale: int) -> int:
    """Return the highest rung at which the peak is expected below `FILL` of full scale.

    The floor of the spectrum stands for bias and dark level; one rung at a time beyond a factor of 16,
    where a weak signal says little.
    """
    best = rung
    for k in range(rung + 1, min(rung + 3, len(times))):
        expected = floor + (peak - floor + 2.0) * times[k] / times[rung]
        if expected < FILL * full_scale:
            best = k
    return best

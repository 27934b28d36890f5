"""Whether one thing measured twice is the same within its own uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.rigfile import Rig
from clbrdf.rig.row import Row
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE, count_variance

BANDS = 8
"""Parts of the spectrum that are compared one by one: a change of colour leaves the sum alone."""

RUNG_REPEATABILITY = 0.005
"""Two integration times of one exposure agree this well, relative: residual nonlinearity, lamp noise."""


@dataclass(frozen=True)
class CheckComparison:
    """The part of the spectrum in which two rows differ most: relative difference, and in its own σ."""

    difference: float
    sigmas: float

    def __str__(self) -> str:
        return f"{self.difference:+.2%} off, {abs(self.sigmas):.1f} of its standard deviations"


def compare(
    rows: Sequence[tuple[Row, Row]],
    window: slice,
    rig: Rig,
    usable: npt.NDArray[np.bool_] | None = None,
    *,
    same_place: bool = False,
) -> CheckComparison:
    """Compare two rows, each with its dark, in up to 8 bands of the window; return the worst.

    Net counts per second and watt of reference power are compared. Their variance is that of counting and
    reading, of the reference power, and of how well a point repeats on this rig (`check_tolerance`; for
    two exposures at the same place, `same_place`, only the lamp and the residual nonlinearity).

    Parameters
    ----------
    rows : ((Row, Row), (Row, Row))
        First and second row, each with its dark.
    window : slice
        Pixels to compare.
    rig : Rig
    usable : bool array, optional
        Pixels of the window that count.
    same_place : bool
        The two follow each other with nothing moved.
    """
    keep = np.ones(len(rows[0][0].counts[window]), bool) if usable is None else usable
    signals, variances = [], []
    for row, dark in rows:
        light = row.counts[window][keep] / row.scans
        level = dark.counts[window][keep] / dark.scans
        scale = 1.0 / row.integration_time / row.reference_power
        signals.append((light - level) * scale)
        own = count_variance(light, rig.spectrometer) / row.scans
        below = count_variance(level, rig.spectrometer) / dark.scans
        variances.append((own + below) * scale**2)
    reading = rig.reference.noise**2 * MEDIAN_OF_THREE  # two rows, each the mean of two medians of three
    repeat = RUNG_REPEATABILITY if same_place else rig.recovery.check_tolerance
    worst = CheckComparison(0.0, 0.0)
    for part in np.array_split(np.arange(int(keep.sum())), BANDS):
        if not len(part):
            continue
        first, second = (float(signal[part].sum()) for signal in signals)
        variance = sum(float(v[part].sum()) for v in variances)
        # Quantisation: half a count of light and half a count of dark in every pixel may go one way.
        steps = sum(len(part) / row.integration_time / row.reference_power / row.scans for row, _ in rows)
        scale = max(abs(first), abs(second))
        sigma = float(np.sqrt(variance + (scale * repeat) ** 2 + (scale**2) * reading + (0.2 * steps) ** 2))
        sigmas = (second - first) / sigma if sigma else 0.0
        if abs(sigmas) > abs(worst.sigmas):
            worst = CheckComparison((second - first) / abs(first) if first else float("inf"), sigmas)
    return worst

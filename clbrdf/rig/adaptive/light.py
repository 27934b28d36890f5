"""What a direction will cost and how well it will be known: the rig's own noise, before the measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.budget import Budget
from clbrdf.rig.exposure import FILL, ladder
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.uncertainty import MEDIAN_OF_THREE, count_variance

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """The light of the rig as its last incident power showed it.

    Attributes
    ----------
    plan, rig, budget
        Ladder of integration times, detector, and what differs from point to point besides counting.
    rate : (W,) float64
        Incident power P_i of (2), counts per second and pixel.
    pixels : (W,) float64
        Over how many pixels a wavelength is averaged.
    floor : float
        Counts without light.
    limit : float
        Count from which a scan is saturated.
    """

    plan: Plan
    rig: Rig
    budget: Budget
    rate: Array
    pixels: Array
    floor: float
    limit: float

    def predict(self, brdf: Array, slopes: Array, cosine: Array) -> tuple[Array, Array]:
        """Return standard uncertainties (W, N), 1/sr, and exposure times (N,), s, scans included.

        Parameters
        ----------
        brdf : (W, N) float64
            1/sr.
        slopes : (W, N) float64
            Root sum square of its derivatives by the two zenith angles, 1/sr per degree.
        cosine : (N,) float64
            cosθr.
        """
        detector, scans = self.rig.spectrometer, self.plan.scans
        per_brdf = self.rate[:, None] * (self.rig.geometry.solid_angle * cosine)
        rate = np.maximum(brdf, 0.0) * per_brdf
        seconds = self._times(rate.max(axis=0))
        counts = self.floor + rate * seconds
        dark = count_variance(np.full(1, self.floor), detector)
        variance = (count_variance(counts, detector) + dark) / (scans * self.pixels[:, None])
        sources = self.budget.points
        counting = variance / (seconds * per_brdf) ** 2 if sources.counting else np.zeros_like(variance)
        reading = self.rig.reference.noise**2 * MEDIAN_OF_THREE / 2.0 if sources.reference else 0.0
        relative = reading + self.budget.remaining("point") ** 2
        total = np.sqrt(counting + relative * brdf**2 + (sources.angle * slopes) ** 2)
        # Zero would count as knowledge without end.
        return np.maximum(total, 1e-9 * np.abs(brdf).max()), seconds * scans

    def _times(self, peak: Array) -> Array:
        """Integration times (N,), s, that the ladder gives to peaks in counts per second."""
        times = np.array(ladder(self.plan, self.plan.shortest_time, self.plan.longest_time))
        room = FILL * self.limit - self.floor
        fitting = np.sum(times[:, None] * peak <= max(room, 1.0), axis=0)
        return np.asarray(times[np.maximum(fitting - 1, 0)])

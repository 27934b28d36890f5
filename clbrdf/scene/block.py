"""What the effects on values pass on: some directions of a scene, at all of its wavelengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.scene.detector import ExposedDirections

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Block:
    """n directions of a scene.

    Attributes
    ----------
    start : int
        Place of the first of them among the random numbers.
    places : (n,) int
        Their places in the scene: when they are measured.
    directions : Directions
        Nominal ones.
    values : (n, W) fp32 or fp64
        BRDF, 1/sr; net counts while there is an exposure.
    variance : (n, W) float64 or None
        Of `values`, from the random effects so far; None where there is none.
    noise : (n, W) float64 or None
        The part of it that differs from value to value, where readers add what does not; else None.
    flagged : (n, W) bool or None
        Saturated values; None where none is.
    exposure : Exposure or None
        How it was exposed, while values are counts.
    subtracted : float or (n, 1) float64
        Dark counts that have been taken off.
    """

    start: int
    places: npt.NDArray[np.intp]
    directions: Directions
    values: npt.NDArray[Any]
    variance: Array | None = None
    noise: Array | None = None
    flagged: npt.NDArray[np.bool_] | None = None
    exposure: ExposedDirections | None = None
    subtracted: float | Array = 0.0

    def age(self, interval: float) -> Array:
        """Return when its directions are measured, (n, 1), s after the start, one every `interval`."""
        return np.asarray(interval * self.places[:, None], dtype=np.float64)

    def plus_variance(self, variance: Array) -> Array:
        """Return the variance with that of one more independent effect."""
        return variance if self.variance is None else self.variance + variance

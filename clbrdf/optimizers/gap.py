"""How far an E is above a reference, relative, with a floor where the reference is nearly 0."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

SMALLEST = 1e-12
"""E below which gaps are taken relative to this value. E is a square: at 1e-12 the model meets the data to
1e-6 of their size. Below it, as where data are without noise, the ratio of two E tells of rounding and of
the step at which a solver stopped, not of the fit; a gap of 1e-8 then means E = 1e-20, deviations of 1e-10,
which is 1000 times the rounding of model values in fp64 (5e-13 relative, squared 2.5e-25)."""


def relative_gap(E: npt.ArrayLike, reference: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return (E − E_ref) / max(E_ref, SMALLEST); infinite where E is not finite."""
    value, best = np.asarray(E, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    gap: npt.NDArray[np.float64] = (value - best) / np.maximum(best, SMALLEST)
    return np.where(np.isfinite(value), gap, np.inf)


def target_value(reference: float, gap: float) -> float:
    """Return the E that stands a gap above a reference."""
    return reference + gap * max(reference, SMALLEST)

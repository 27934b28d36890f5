"""Electrons come one by one.

    counts = Poisson((counts + dark) · gain) / gain − dark,     gain in electrons per count

Source: Poisson statistics of a photon detector. The paper counts it in the signal-to-noise term 0.4 % of
(6).

A scene draws each number by inversion from one uniform number of its own, so that no other value has a say
in it; from 100 electrons on with the expansion of Cornish and Fisher,

    k = ⌈m + √m z + (z² − 1)/6 + (z − z³)/(72 √m) − 1/2⌉,   z the normal quantile,

which is off by one electron in a few of 1000 draws, and never by more (tests/scene). Source: Johnson, Kotz
and Kemp, Univariate Discrete Distributions (2nd ed., 1992), chapter 4.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

MOST_ELECTRONS = 1e9
EXPANDED_FROM = 100.0


class ShotNoise(TomlTable):
    """It has no settings; the gain is the detector's."""


def with_shot_noise(
    counts: Array, dark: float | Array, gain: float, draw: Callable[[Array], npt.NDArray[Any]]
) -> Array:
    """Return counts with noise; `draw` gives Poisson deviates for expected electrons."""
    charge = np.minimum((counts + dark) * gain, MOST_ELECTRONS)
    return np.asarray(draw(charge) / gain - dark)


def poisson_quantile(mean: Array, uniform: Array) -> Array:
    """Return the Poisson deviates that belong to uniform numbers in (0, 1); 0 for means not above 0.

    A mean that is NaN stays NaN: what is not known gets no electrons.
    """
    from scipy.special import ndtri, pdtrik

    z, m = ndtri(uniform), np.maximum(mean, 1e-300)
    root = np.sqrt(m)
    out = np.ceil(m + root * z + (z**2 - 1.0) / 6.0 + (z - z**3) / (72.0 * root) - 0.5)
    few = mean < EXPANDED_FROM
    if few.any():
        exact = np.ceil(pdtrik(uniform[few], m[few]))
        out[few] = np.where(np.isfinite(exact), np.maximum(exact, 0.0), 0.0)
    return np.where(np.isnan(mean), np.nan, np.where(mean > 0.0, np.maximum(out, 0.0), 0.0))

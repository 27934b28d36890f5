"""The electronics add noise to every reading, however dark.

    counts + sigma · z,     z standard normal

Source: additive Gaussian readout noise; the paper counts it in the signal-to-noise term 0.4 % of (6), the
default of 3 counts is that of the rig's sample file.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class ReadNoise(TomlTable):
    """Settings.

    Attributes
    ----------
    sigma : float
        Standard deviation, counts.
    """

    sigma: Annotated[float, Field(ge=0.0)] = 3.0


def with_read_noise(counts: Array, sigma: float, deviates: Array) -> Array:
    """Return counts with noise, for standard normal deviates of the same shape."""
    return counts + sigma * deviates

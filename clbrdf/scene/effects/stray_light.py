"""Light scattered inside the spectrometer falls on every pixel.

    counts + share · mean(counts over the spectrum)

Source: the usual first-order model of an even background; equation (5) of Wang, Zhang and Dong (2013) gives
stray light 1 %.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class StrayLight(TomlTable):
    """Settings.

    Attributes
    ----------
    share : float
        Of the mean signal that falls on every pixel.
    """

    share: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.01


def with_stray_light(counts: Array, share: float) -> Array:
    """Return the counts (..., W) of spectra with their stray light."""
    return np.asarray(counts + share * counts.mean(axis=-1, keepdims=True))

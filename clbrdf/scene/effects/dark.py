"""Counts without light: the detector's dark current, which grows while the dark spectrum gets old.

    dark counts = rate · t · (1 + drift · hours)

With `subtracted` the dark spectrum of the start, rate · t, is taken off again, and what drift adds stays.
The dark charge makes noise (`shot_noise`) and fills the well (`saturation`) all the same. Source: dark
current of an integrating detector; the paper gives none, the rate is that of the emulated spectrometer of
the rig.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.scene.effects.lamp_drift import drift_factor
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class DarkSignal(TomlTable):
    """Settings.

    Attributes
    ----------
    rate : float
        Counts per second.
    drift : float
        Relative change in an hour.
    interval : float
        From one direction to the next, s.
    subtracted : bool
        Whether the dark counts of the start are taken off.
    """

    rate: Annotated[float, Field(ge=0.0)] = 20.0
    drift: Annotated[float, Field(gt=-1.0, lt=10.0)] = 0.0
    interval: Annotated[float, Field(ge=0.0, le=86400.0)] = 10.0
    subtracted: bool = True


def dark_counts(rate: float, drift: float, seconds: float | Array, age: float | Array) -> float | Array:
    """Return dark counts of an exposure of some seconds, `age` seconds after the start."""
    return rate * seconds * drift_factor(drift, age)

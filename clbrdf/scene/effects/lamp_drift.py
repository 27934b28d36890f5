"""The lamp changes while the directions are measured, and nothing watches it.

    f · (1 + per_hour · t),     t = n · interval for the n-th direction

Source: equation (5) of Wang, Zhang and Dong (2013): lamp stability 0.1 %, here for each hour.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class LampDrift(TomlTable):
    """Settings.

    Attributes
    ----------
    per_hour : float
        Relative change in an hour.
    interval : float
        From one direction to the next, s.
    """

    per_hour: Annotated[float, Field(gt=-1.0, lt=1.0)] = 0.001
    interval: Annotated[float, Field(ge=0.0, le=86400.0)] = 10.0


def drift_factor(per_hour: float, seconds: float | Array) -> float | Array:
    """Return what was 1 at the start, after seconds of drift."""
    return 1.0 + per_hour * (seconds / 3600.0)

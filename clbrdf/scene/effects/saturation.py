"""The converter ends at full scale; what would be more reads as full scale, and is flagged.

    raw counts = min(bias + dark + counts, full scale)

Source: a converter of so many bits; full scale and bias are the detector's.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Saturation(TomlTable):
    """It has no settings; full scale is the detector's."""


def cut_at(counts: Array, room: float | Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return counts cut where the converter ends, and which were cut; `room` is what is left for them."""
    return np.minimum(counts, room), counts >= room

"""What is left out of a page so that it stays small: directions, then wavelengths, evenly, and counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

LARGEST = 3_100_000
"""Bytes of measured values in a page; as text they are a third more, and the whole stays below 5 MB."""

DIRECTION_BYTES = 32
DOUBLE_BYTES, SINGLE_BYTES = 17, 9
"""Of a value with its uncertainty and its flag, in double and in single precision."""

FEWEST_DIRECTIONS = 1000
"""Directions are thinned to these before wavelengths are."""


@dataclass(frozen=True)
class Thinning:
    """Which directions and wavelengths a page holds, and in which precision measured values are kept."""

    rows: npt.NDArray[np.intp]
    columns: npt.NDArray[np.intp]
    kind: str
    words: tuple[str, ...]


def thinning(
    directions: int, wavelengths: int, budget: int = LARGEST, fixed: int = 0, more: int = 0
) -> Thinning:
    """Choose what fits into a budget of bytes.

    Parameters
    ----------
    directions, wavelengths : int
    budget : int
        Bytes.
    fixed : int
        Bytes that every wavelength takes besides its values.
    more : int
        Numbers beside each value and its uncertainty.
    """
    double, single = DOUBLE_BYTES + 8 * more, SINGLE_BYTES + 4 * more
    rows, columns = np.arange(directions), np.arange(wavelengths)
    room = budget - directions * DIRECTION_BYTES - wavelengths * fixed
    if directions * wavelengths * double <= room:
        return Thinning(rows, columns, "f8", ())
    words = ["measured values are kept to 7 digits"]
    least = min(directions, FEWEST_DIRECTIONS)
    width = (budget - least * DIRECTION_BYTES) // (least * single + fixed)
    if wavelengths > width:
        columns = _spread(wavelengths, max(1, int(width)))
        words.append(f"{len(columns)} of {wavelengths} wavelengths are in this page, evenly chosen")
    rest = budget - len(columns) * fixed
    height = int(rest // (len(columns) * single + DIRECTION_BYTES))
    if directions > height:
        rows = _spread(directions, max(1, height))
        words.append(f"{len(rows)} of {directions} directions are in this page, evenly chosen")
    return Thinning(rows, columns, "f4", tuple(words))


def _spread(count: int, kept: int) -> npt.NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, kept).round().astype(np.intp))

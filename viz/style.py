"""Colours and sizes of all pictures, chosen to survive colour blindness and grey print.

Okabe and Ito's palette for lines and marks (M. Okabe, K. Ito, "Color Universal Design", 2008), viridis for
values, PuOr for differences.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
import numpy.typing as npt

ColourMode = Literal["value", "spectrum"]

COLOUR_MODES: tuple[ColourMode, ...] = ("value", "spectrum")

BLACK, GREY, PALE, WHITE = "#000000", "#6f6f6f", "#ececec", "#ffffff"
ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#e69f00",
    "#56b4e9",
    "#009e73",
    "#0072b2",
    "#d55e00",
    "#cc79a7",
)
SERIES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)

VALUE_MAP, DIFFERENCE_MAP = "viridis", "PuOr_r"


@dataclass(frozen=True)
class LobeStyle:
    """How lobes are drawn.

    Attributes
    ----------
    radius : "linear", "log" or "cosine"
    colour : "value" or "spectrum"
    floor : float or None
        1/sr at length 0 of the logarithmic radius; chosen from the values if None.
    points : bool
        Whether measured points and their residuals are drawn.
    """

    radius: Literal["linear", "log", "cosine"] = "linear"
    colour: ColourMode = "value"
    floor: float | None = None
    points: bool = True


@cache
def colour_table(name: str) -> npt.NDArray[np.uint8]:
    """Return 256 colours (256, 3) of a matplotlib colour map."""
    import matplotlib

    table = matplotlib.colormaps[name](np.arange(256) / 255.0)[:, :3]
    return np.asarray(np.rint(255.0 * table), dtype=np.uint8)


def rgb(text: str) -> tuple[float, float, float]:
    """Return red, green, blue in [0, 1] of "#rrggbb"."""
    return int(text[1:3], 16) / 255.0, int(text[3:5], 16) / 255.0, int(text[5:7], 16) / 255.0

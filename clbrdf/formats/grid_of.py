"""The grid that a scan's directions are, where they are one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]

SAME = 1e-6
"""Degrees within which two angles are one node of a grid."""


@dataclass(frozen=True, eq=False)
class FitGrid:
    """Axes of a grid, and which row of the scan each cell is.

    Attributes
    ----------
    axes : tuple of (K,) float64
    row : int array of the axes' lengths
        −1 where no direction of the scan is there.
    """

    axes: tuple[Array, ...]
    row: npt.NDArray[np.intp]


def grid_of(coordinates: Sequence[Array], most: int = 50_000_000) -> FitGrid:
    """Return the grid that coordinates (N,) of each axis make.

    Raises
    ------
    InputError
        The product of the axes is far larger than the scan: its directions are scattered.
    """
    axes, places = [], []
    for values in coordinates:
        ordered = np.sort(values)
        # Neighbours within rounding are one node.
        begins = np.append(True, np.diff(ordered) > SAME)
        nodes = ordered[begins]
        place = np.searchsorted(nodes, values + SAME, side="right") - 1
        axes.append(nodes)
        places.append(place)
    shape = tuple(len(axis) for axis in axes)
    total = int(np.prod(shape, dtype=object))
    if total > min(most, 20 * len(coordinates[0]) + 1000):
        raise InputError(f"{len(coordinates[0])} directions are scattered, and no grid")
    row = np.full(shape, -1, dtype=np.intp)
    row[tuple(places)] = np.arange(len(coordinates[0]))
    return FitGrid(tuple(axes), row)

"""Lines of view: directions of one incident direction in one plane, in the order of the signed θr."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.scan.rectangle import group_numbers

SAME_LINE = 0.05
"""Degrees: azimuths nearer than this lie on one line."""

FEWEST_ON_A_LINE = 3


def view_lines(directions: Directions) -> list[npt.NDArray[np.intp]]:
    """Return the places of the directions of each line of at least FEWEST_ON_A_LINE.

    A line runs through the plane that holds the surface's normal: the half-planes φ and φ + 180° are one.
    """
    turned = directions.phi % 180.0
    turned = np.where(180.0 - turned < SAME_LINE / 2.0, 0.0, turned)
    ahead = np.abs(directions.phi - turned) < SAME_LINE
    signed = np.where(ahead, -directions.theta_r, directions.theta_r)
    key = np.stack([directions.theta_i, directions.phi_i, np.round(turned / SAME_LINE)], axis=1)
    line = group_numbers(np.asarray(np.round(key, 6), dtype=np.float64))
    order = np.lexsort((signed, line))
    begins = np.append(0, np.flatnonzero(np.diff(line[order])) + 1)
    lengths = np.diff(np.append(begins, len(order)))
    long = lengths >= FEWEST_ON_A_LINE  # of random directions each is a line of its own
    pairs = zip(begins[long], lengths[long], strict=True)
    return [order[begin : begin + length] for begin, length in pairs]

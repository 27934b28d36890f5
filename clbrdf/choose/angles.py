"""Incident angles that are left out one at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

SAME_ANGLE = 0.5
"""Degrees: incident zeniths nearer than this are one setting of the source that was read back. To leave out
one of them and to keep the other would leave the answer in."""


@dataclass(frozen=True, eq=False)
class AngleGroups:
    """Incident zeniths, each with its directions.

    Attributes
    ----------
    theta_i : (I,) float64
        Mean of each group, degrees, increasing.
    group : (N,) int
        Place of each direction's group.
    """

    theta_i: Array
    group: npt.NDArray[np.intp]


def incident_groups(scan: Scan) -> AngleGroups:
    """Group the directions of a scan by incident zenith."""
    angles, place = np.unique(scan.theta_i, return_inverse=True)
    number = np.append(0, np.cumsum(np.diff(angles) > SAME_ANGLE))
    group = number[place.ravel()]
    mean = np.bincount(group, weights=scan.theta_i) / np.bincount(group)
    # The mean of equal angles is that angle, to the last bit.
    low, high = (
        angles[np.searchsorted(number, np.arange(len(mean)))],
        np.maximum.reduceat(angles, np.searchsorted(number, np.arange(len(mean)))),
    )
    return AngleGroups(np.where(low == high, low, mean), group)

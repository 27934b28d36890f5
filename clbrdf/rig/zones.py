"""Collision zones: where lamp, turn and pitch must not stand together, and ways around.

A zone is a box in the space of the three axes. Axes that move together take different times, so on the
way from one pose to another every pose in the box between the two may occur: a leg is free where that box
meets no zone. Axes that move one after the other sweep three thin boxes instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, permutations

import numpy as np
import numpy.typing as npt

Pose = tuple[float, ...]
Zone = tuple[tuple[float, float], ...]
"""Lowest and highest angle of lamp, turn and pitch, degrees."""


def is_inside(poses: npt.NDArray[np.float64], zones: Sequence[Zone]) -> npt.NDArray[np.bool_]:
    """Say which poses (..., 3), degrees, lie in a zone."""
    inside = np.zeros(poses.shape[:-1], bool)
    for zone in zones:
        low, high = np.array(zone).T
        inside |= ((poses >= low) & (poses <= high)).all(axis=-1)
    return inside


def is_free(here: Pose, there: Pose, zones: Sequence[Zone]) -> bool:
    """Say whether the box between two poses meets no zone."""
    return not any(
        all(
            min(a, b) <= high and max(a, b) >= low
            for a, b, (low, high) in zip(here, there, zone, strict=True)
        )
        for zone in zones
    )


def find_legs(
    here: Pose, there: Pose, zones: Sequence[Zone], between: Sequence[Pose] = ()
) -> list[Pose] | None:
    """Return poses to go through, the target last; None where no way is found.

    Tried in this order: all axes at once; one axis after the other, in each order; the same by way of
    one of the poses `between`, such as home or park.
    """
    if is_free(here, there, zones):
        return [there]
    direct = _one_by_one(here, there, zones)
    if direct is not None:
        return direct
    for middle in between:
        first, second = _leg(here, middle, zones), _leg(middle, there, zones)
        if first is not None and second is not None:
            return first + second
    return None


def _leg(here: Pose, there: Pose, zones: Sequence[Zone]) -> list[Pose] | None:
    return [there] if is_free(here, there, zones) else _one_by_one(here, there, zones)


def _one_by_one(here: Pose, there: Pose, zones: Sequence[Zone]) -> list[Pose] | None:
    for order in permutations(range(len(here))):
        poses = [here]
        for axis in order:
            pose = list(poses[-1])
            pose[axis] = there[axis]
            poses.append(tuple(pose))
        if all(is_free(a, b, zones) for a, b in pairwise(poses)):
            return poses[1:]
    return None

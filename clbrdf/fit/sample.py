"""Some directions that stand for many, chosen by geometry alone: neither values nor wavelengths matter.

Directions near the mirror direction, where lobes have their tops, are taken more often; each of the others
stands for its neighbours with a larger weight, so that sums over directions keep their meaning.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SAMPLE = 2048
"""Directions of a sample."""

MANY = 2 * SAMPLE
"""Up to so many directions are all searched."""

SEED = 14
"""Of the draw in each stratum: the same directions give the same sample."""

NEAREST = 16
"""The density of a sample falls as 1 / (rank + size / NEAREST): most of the nearest are taken."""


@dataclass(frozen=True, eq=False)
class DirectionSample:
    """M of N directions.

    Attributes
    ----------
    places : (M,) int
        Increasing.
    weight : (M,) float64
        How many of the N directions each stands for.
    """

    places: npt.NDArray[np.intp]
    weight: Array


def sample_of(mirror: Array, most: int) -> DirectionSample:
    """Return at most so many directions, one drawn in each stratum of the distance from the mirror direction.

    Half of the strata are equally large, the other half grow with rank, so that a peak of any width has some
    directions within it.

    Parameters
    ----------
    mirror : (N,) float64
        Distance from the mirror direction.
    most : int
    """
    n = len(mirror)
    order, rank, core = np.argsort(mirror, kind="stable"), np.arange(n), max(1.0, most / NEAREST)
    share = 0.5 * rank / n + 0.5 * np.log1p(rank / core) / np.log1p(n / core)
    first = np.flatnonzero(np.diff(np.floor(share * most), prepend=-1.0))
    size = np.diff(np.append(first, n))
    drawn = first + (np.random.default_rng(SEED).random(len(first)) * size).astype(np.intp)
    places = order[drawn]
    rising = np.argsort(places)
    return DirectionSample(places[rising], size[rising].astype(np.float64))

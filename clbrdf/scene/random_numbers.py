"""Random numbers that belong to a place: (seed, effect, direction, wavelength) alone decide each one.

Philox with the seed and the effect's name as key and the place as counter: blocks of any size and order
give the same numbers. Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3",
SC11 (2011), doi:10.1145/2063384.2063405, as in NumPy.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

PER_COUNT = 4
"""Numbers that one count of the generator yields."""

LARGEST_SEED = 2**63 - 1


def uniform(seed: int, effect: str, start: int, rows: int, columns: int) -> Array:
    """Return numbers (rows, columns) in (0, 1): those of the directions from `start` on."""
    key = np.array([seed, int.from_bytes(effect.encode()[:8], "little")], dtype=np.uint64)
    first = start * columns
    skip = first % PER_COUNT
    generator = np.random.Philox(key=key, counter=first // PER_COUNT)
    raw = generator.random_raw(skip + rows * columns)[skip:]
    return np.asarray(((raw >> np.uint64(11)) + 0.5).reshape(rows, columns) * 2.0**-53, np.float64)


def normal(seed: int, effect: str, start: int, rows: int, columns: int) -> Array:
    """Return standard normal deviates (rows, columns), by inversion of `uniform`."""
    from scipy.special import ndtri

    return np.asarray(ndtri(uniform(seed, effect, start, rows, columns)))

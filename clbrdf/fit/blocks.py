"""Wavelengths in blocks, so that memory and the time between two looks at Ctrl-C stay bounded."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.sample import MANY, SAMPLE

BLOCK_BYTES = 128 << 20
"""Data of one block, at most (one wavelength is always taken)."""

LAUNCH_EVALUATIONS = 400_000_000
"""Model evaluations of one launch, at most: some tenths of a second on two cores."""

LAST_PASSES = 40
"""Over all of many directions, in model evaluations: what the end of the polish takes in one launch."""


def bytes_each(directions: int) -> int:
    """Return the bytes of one wavelength in a block: scaled values, their scale, the device's copies."""
    return 32 * directions


def evaluations_each(directions: int, passes: int) -> int:
    """Return the model evaluations of the longest launch of one wavelength; many directions are sampled."""
    return passes * directions if directions <= MANY else max(passes * SAMPLE, LAST_PASSES * directions)


def wavelength_blocks(
    wavelengths: npt.NDArray[np.intp], bytes_each: int, evaluations_each: int
) -> list[npt.NDArray[np.intp]]:
    """Split places of wavelengths into blocks of about one size, for what one takes.

    Random numbers are keyed by wavelength, so the blocks do not change the result.
    """
    most = max(1, min(BLOCK_BYTES // bytes_each, LAUNCH_EVALUATIONS // evaluations_each))
    return np.array_split(wavelengths, -(-len(wavelengths) // most))

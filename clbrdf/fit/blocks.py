"""Wavelengths in blocks, so that memory and the time between two looks at Ctrl-C stay bounded."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

DEVICE_BYTES = 128 << 20
"""Data of one block on the device, at most (one wavelength is always taken)."""

LAUNCH_EVALUATIONS = 400_000_000
"""Model evaluations of one launch, at most: some tenths of a second on two cores."""


def wavelength_blocks(
    wavelengths: npt.NDArray[np.intp], bytes_each: int, evaluations_each: int
) -> list[npt.NDArray[np.intp]]:
    """Split places of wavelengths into blocks, for what one takes on the device.

    Random numbers are keyed by wavelength, so the blocks do not change the result.
    """
    size = max(1, min(DEVICE_BYTES // bytes_each, LAUNCH_EVALUATIONS // evaluations_each))
    return [wavelengths[first : first + size] for first in range(0, len(wavelengths), size)]

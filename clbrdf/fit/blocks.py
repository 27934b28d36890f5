"""Wavelengths in blocks, so that memory and the time between two looks at Ctrl-C stay bounded."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.fit.anneal import Settings

DEVICE_BYTES = 128 << 20
"""Data of one block on the device, at most (one wavelength is always taken)."""

LAUNCH_EVALUATIONS = 400_000_000
"""Model evaluations of one launch, at most: some tenths of a second on two cores."""


def wavelength_blocks(
    wavelengths: npt.NDArray[np.intp], directions: int, parameters: int, settings: Settings
) -> list[npt.NDArray[np.intp]]:
    """Split places of wavelengths into blocks, for so many directions and parameters of the model.

    Random numbers are keyed by wavelength, so the blocks do not change the result.
    """
    bytes_each = 24 * directions + 256 * settings.chains  # fp32 and fp64 copies; state of the chains
    evaluations_each = directions * settings.chains * settings.sweeps * parameters
    size = max(1, min(DEVICE_BYTES // bytes_each, LAUNCH_EVALUATIONS // evaluations_each))
    return [wavelengths[first : first + size] for first in range(0, len(wavelengths), size)]

"""The colour of a lobe: its chromaticity in daylight, at full brightness."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.colour import XYZ_TO_RGB, encode_srgb

Array = npt.NDArray[np.float64]


def chromatic_rgb(xyz: Array) -> npt.NDArray[np.uint8]:
    """SRGB (..., 3), 8 bits, with the chromaticity of XYZ (..., 3) and the largest channel full.

    Brightness is left out: a lobe's peak and its foot differ by decades, and shading shows the shape.
    Colours outside sRGB are brought in by adding white.
    """
    rgb = np.asarray(xyz, dtype=np.float64) @ XYZ_TO_RGB.T
    rgb = rgb - np.minimum(rgb.min(axis=-1, keepdims=True), 0.0)
    largest = rgb.max(axis=-1, keepdims=True)
    rgb = np.divide(rgb, largest, out=np.ones_like(rgb), where=largest > 0.0)
    return np.asarray(np.rint(255.0 * encode_srgb(rgb)), dtype=np.uint8)

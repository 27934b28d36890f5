"""Where a direction points in the pictures, and back.

World frame: z along the surface normal, x forward, to the side of the mirror direction (φ = 180°). The
source stands at φ = 0, on the −x side; φ grows anticlockwise seen from above. Vectors have unit length.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def unit_vectors(theta: npt.ArrayLike, phi: npt.ArrayLike) -> Array:
    """Return unit vectors (..., 3) of zenith and azimuth angles in degrees (broadcast)."""
    zenith, azimuth = np.broadcast_arrays(np.deg2rad(theta), np.deg2rad(phi))
    across = np.sin(zenith)
    return np.stack([-across * np.cos(azimuth), -across * np.sin(azimuth), np.cos(zenith)], axis=-1)


def angles_of(vectors: npt.ArrayLike) -> tuple[Array, Array]:
    """Return zenith [0, 180] and azimuth [0, 360) in degrees of vectors (..., 3) of any length > 0."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0)
    zenith = np.rad2deg(np.arctan2(np.hypot(x, y), z))
    azimuth = np.mod(np.rad2deg(np.arctan2(-y, -x)), 360.0)
    return zenith, np.where(azimuth == 360.0, 0.0, azimuth)

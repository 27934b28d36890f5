"""Coordinates of other formats as zenith and azimuth: about the specular direction, and half and difference.

All functions take and give degrees, arrays that broadcast. Vectors have z along the normal; the source
stands at azimuth 0 of its own frame, so that φ = φr − φi has 180° forward.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import cos_deg, sin_deg, wrap_azimuth

Array = npt.NDArray[np.float64]


def polar(x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """Return zenith [0, 180] and azimuth [0, 360) of vectors, degrees; azimuth 0 along the normal."""
    zenith = np.rad2deg(np.arctan2(np.hypot(x, y), z))
    return zenith, wrap_azimuth(np.rad2deg(np.arctan2(y, x)))


def from_specular(theta_i: Array, azimuth: Array, radial: Array) -> tuple[Array, Array]:
    """Return θr and φ of directions given about the specular direction.

    `radial` is the angle from the specular direction, [0, 180]; `azimuth` 0 lies from it towards the normal.
    """
    theta, azimuth = np.asarray(theta_i, dtype=np.float64), np.asarray(azimuth, dtype=np.float64)
    turn = azimuth - 360.0 * np.round(azimuth / 360.0)
    sin_r, cos_r = sin_deg(radial), cos_deg(radial)
    sin_i, cos_i = sin_deg(theta), cos_deg(theta)
    along = sin_r * cos_deg(turn)
    theta_r, phi = polar(along * cos_i - cos_r * sin_i, sin_r * sin_deg(turn), along * sin_i + cos_r * cos_i)
    # The specular direction itself comes out exactly.
    at_peak = np.broadcast_to(np.equal(radial, 0.0), theta_r.shape)
    return np.where(at_peak, theta, theta_r), np.where(at_peak, 180.0, phi)


def to_specular(theta_i: Array, theta_r: Array, phi: Array) -> tuple[Array, Array]:
    """Return azimuth and radial angle about the specular direction, the inverse of `from_specular`."""
    turn = np.where(phi > 180.0, phi - 360.0, phi)
    sin_r, cos_r = sin_deg(theta_r), cos_deg(theta_r)
    sin_i, cos_i = sin_deg(theta_i), cos_deg(theta_i)
    x, y = sin_r * cos_deg(turn), sin_r * sin_deg(turn)
    radial, azimuth = polar(x * cos_i + cos_r * sin_i, y, cos_r * cos_i - x * sin_i)
    return azimuth, radial


def from_half_difference(theta_h: Array, theta_d: Array, phi_d: Array) -> tuple[Array, Array, Array]:
    """Return θi, θr and φ of directions given by half and difference angles (Rusinkiewicz 1998).

    θ come out above 90° where a direction lies below the horizon.
    """
    turn = np.where(phi_d > 180.0, phi_d - 360.0, phi_d)
    sin_h, cos_h = sin_deg(theta_h), cos_deg(theta_h)
    sin_d, cos_d = sin_deg(theta_d), cos_deg(theta_d)
    across, y = sin_d * cos_deg(turn), sin_d * sin_deg(turn)
    theta_i, phi_i = polar(cos_h * across + sin_h * cos_d, y, cos_h * cos_d - sin_h * across)
    theta_r, phi_r = polar(sin_h * cos_d - cos_h * across, -y, cos_h * cos_d + sin_h * across)
    return theta_i, theta_r, wrap_azimuth(phi_r - phi_i)


def to_half_difference(theta_i: Array, theta_r: Array, phi: Array) -> tuple[Array, Array, Array]:
    """Return θh, θd and φd in [0, 180), the inverse of `from_half_difference` for a reciprocal surface."""
    turn = np.where(phi > 180.0, phi - 360.0, phi)
    source = np.stack(np.broadcast_arrays(sin_deg(theta_i), 0.0 * theta_i, cos_deg(theta_i)))
    view = np.stack(
        np.broadcast_arrays(
            sin_deg(theta_r) * cos_deg(turn), sin_deg(theta_r) * sin_deg(turn), cos_deg(theta_r)
        )
    )
    theta_h, phi_h = polar(*(source + view))
    rotated = np.where(phi_h > 180.0, phi_h - 360.0, phi_h)
    sin_h, cos_h = sin_deg(theta_h), cos_deg(theta_h)
    x = source[0] * cos_deg(rotated) + source[1] * sin_deg(rotated)
    y = source[1] * cos_deg(rotated) - source[0] * sin_deg(rotated)
    theta_d, phi_d = polar(x * cos_h - source[2] * sin_h, y, x * sin_h + source[2] * cos_h)
    return theta_h, theta_d, np.mod(phi_d, 180.0)

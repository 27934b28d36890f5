"""Directions as the tables of an RGL file take them: half vectors on the unit square, and back.

    θ = u² π/2,  φ = (2u − 1) π

for zeniths and azimuths alike of half vectors m (normals of microfacets) and incident directions.
Everything here is in radians; azimuths are relative to the incident direction, 0 on its side.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def zenith_of(u: Array) -> Array:
    """Zenith of a coordinate in [0, 1]."""
    return np.asarray(u * u * (np.pi / 2.0))


def azimuth_of(u: Array) -> Array:
    """Azimuth of a coordinate in [0, 1]."""
    return np.asarray((2.0 * u - 1.0) * np.pi)


def zenith_coordinate(theta: Array) -> Array:
    """Coordinate in [0, 1] of a zenith."""
    return np.sqrt(theta * (2.0 / np.pi))


def azimuth_coordinate(phi: Array) -> Array:
    """Coordinate in [0, 1) of an azimuth of any turn."""
    turn = (phi + np.pi) / (2.0 * np.pi)
    return np.asarray(turn - np.floor(turn))


def half_vector(theta_i: Array, theta_r: Array, phi: Array) -> tuple[Array, Array]:
    """Zenith and azimuth of the half vector, the latter from the incident direction.

    From sums and differences of angles, without cancellation at the mirror direction, φ = π: the plane
    components of ωi + ωr are sinθi + sinθr cosφ and sinθr sinφ, and with c = cos²(φ/2) the first is
    2 cos((θi + θr)/2) sin((θi − θr)/2) + 2 c sinθr.
    """
    mean, half = (theta_i + theta_r) / 2.0, (theta_i - theta_r) / 2.0
    # φ/2 is reduced from π, so that cos²(φ/2) keeps its digits where the peak stands.
    opposite = np.sin((np.pi - phi) / 2.0) ** 2
    along = 2.0 * np.cos(mean) * np.sin(half) + 2.0 * opposite * np.sin(theta_r)
    across = np.sin(theta_r) * np.sin(np.pi - phi)
    up = 2.0 * np.cos(mean) * np.cos(half)
    return np.arctan2(np.hypot(along, across), up), np.arctan2(across, along)


def reflected(theta_i: Array | float, theta_m: Array, phi_m: Array) -> tuple[Array, Array, Array]:
    """Reflect at half vectors: ωi·m, the cosine of the view zenith and the view azimuth.

    The cosine is negative for half vectors that send the light below the surface.
    """
    sin_i, cos_i = np.sin(theta_i), np.cos(theta_i)
    sin_m, cos_m, cos_p = np.sin(theta_m), np.cos(theta_m), np.cos(phi_m)
    dot = sin_i * sin_m * cos_p + cos_i * cos_m
    x = 2.0 * dot * sin_m * cos_p - sin_i
    y = 2.0 * dot * sin_m * np.sin(phi_m)
    z = 2.0 * dot * cos_m - cos_i
    return dot, np.clip(z, -1.0, 1.0), np.arctan2(y, x)


def horizon(theta_i: Array, phi_m: Array) -> Array:
    """Zenith of the half vector that reflects into the horizon; larger ones reflect below it.

    cosθr = sinθi cosφm sin2θm + cosθi cos2θm vanishes at θm = π/4 + ½ atan(tanθi cosφm).
    """
    tilt = np.arctan2(np.sin(theta_i) * np.cos(phi_m), np.cos(theta_i))
    return np.asarray(np.pi / 4.0 + tilt / 2.0)

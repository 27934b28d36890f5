"""Directions as unit vectors in the sample's frame (normal z, source at azimuth 0), and back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg, sin_deg

Array = npt.NDArray[np.float64]


def unit_vector(theta: Array, phi: Array) -> Array:
    """Return unit vectors (..., 3) of zeniths and azimuths in degrees within [−180, 360)."""
    folded = np.where(phi > 180.0, phi - 360.0, phi)
    sine = sin_deg(theta)
    return np.stack([sine * cos_deg(folded), sine * sin_deg(folded), cos_deg(theta)], axis=-1)


def pair_of_vectors(directions: Directions) -> tuple[Array, Array]:
    """Return unit vectors (N, 3) towards source and detector."""
    zero = np.zeros(len(directions))
    return unit_vector(directions.theta_i, zero), unit_vector(directions.theta_r, directions.phi)


def mirrored(vector: Array) -> Array:
    """Return the mirror directions (..., 3): turned by half a circle about the normal."""
    return np.asarray(vector * np.array([-1.0, -1.0, 1.0]))


def angle_beside(vector: Array, degrees: Array, azimuth: Array) -> Array:
    """Turn unit vectors (N, 3) away from the normal, in the plane of their azimuth (degrees)."""
    along = unit_vector(np.full(len(vector), 90.0), azimuth)
    zenith = np.rad2deg(np.arctan2((vector * along).sum(axis=1), vector[:, 2])) + degrees
    return along * sin_deg(zenith)[:, None] + np.array([0.0, 0.0, 1.0]) * cos_deg(zenith)[:, None]


def zenith_azimuth(vector: Array, normal: Array | None = None) -> tuple[Array, Array]:
    """Return zenith and azimuth, degrees, of unit vectors (..., 3), seen from a tilted normal (3,) or from z.

    The tilted frame is the plain one turned about the horizontal axis at right angles to the tilt.
    """
    if normal is not None and normal[2] < 1.0:
        axis = np.array([-normal[1], normal[0], 0.0])
        sine = float(np.linalg.norm(axis))
        axis = axis / sine
        # Turn back by the tilt (Rodrigues).
        cosine = normal[2]
        vector = (
            vector * cosine
            - np.cross(axis, vector) * sine
            + axis * (vector @ axis)[..., None] * (1.0 - cosine)
        )
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.rad2deg(np.arctan2(np.hypot(x, y), z)), np.rad2deg(np.arctan2(y, x))


def directions_of(source: Array, view: Array, normal: Array | None = None) -> Directions:
    """Return the directions of unit vectors (N, 3) towards source and detector."""
    theta_i, phi_i = zenith_azimuth(source, normal)
    theta_r, phi_r = zenith_azimuth(view, normal)
    return Directions.relative(theta_i, theta_r, phi_r - phi_i)


def tangents(centre: Array, towards: Array) -> tuple[Array, Array]:
    """Two unit tangents (N, 3) at the centres, the first towards another direction where it differs."""
    along = towards - centre * (towards * centre).sum(axis=1)[:, None]
    length = np.linalg.norm(along, axis=1)
    # Any tangent serves where the two directions coincide.
    spare = np.where(np.abs(centre[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    spare = spare - centre * (spare * centre).sum(axis=1)[:, None]
    along = np.where((length > 1e-12)[:, None], along, spare)
    first = along / np.linalg.norm(along, axis=1)[:, None]
    return first, np.cross(centre, first)

"""Points that fill the space of directions, and how far two of them are apart."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg, sin_deg

Array = npt.NDArray[np.float64]

NARROWEST = 0.3
"""Angles from the mirror direction below this, degrees, count as one: lobes are seldom narrower."""


def view_vectors(directions: Directions) -> Array:
    """View directions (N, 3) as unit vectors; the incident azimuth is 0."""
    across = sin_deg(directions.theta_r)
    vectors: Array = np.stack(
        [across * cos_deg(directions.phi), across * sin_deg(directions.phi), cos_deg(directions.theta_r)],
        axis=-1,
    )
    return vectors


def mirror_angles(directions: Directions) -> Array:
    """Angles (N,) between view and mirror direction, degrees."""
    mirror = np.stack(
        [-sin_deg(directions.theta_i), np.zeros(len(directions)), cos_deg(directions.theta_i)], axis=-1
    )
    return _angles_between(view_vectors(directions), mirror)


def _angles_between(one: Array, other: Array) -> Array:
    # The half chord keeps its accuracy for directions that nearly agree.
    chord = np.sqrt(np.sum((one - other) ** 2, axis=-1))
    return np.asarray(2.0 * np.rad2deg(np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))))


def coordinates(directions: Directions) -> Array:
    """Return the space (N, 4) that is to be filled, each coordinate of about unit length.

    Incident zenith, projected view direction, and the logarithm of the angle from the mirror direction:
    a lobe of any width gets its points.
    """
    vectors = view_vectors(directions)
    most = np.log1p(180.0 / NARROWEST)
    near = np.log1p(mirror_angles(directions) / NARROWEST) / most
    return np.stack([directions.theta_i / 90.0, vectors[:, 0], vectors[:, 1], 2.0 * near], axis=-1)


def nearest_taken(space: Array, taken: list[int]) -> Array:
    """Distances (N,) to the nearest point taken; infinite where there is none."""
    out = np.full(len(space), np.inf)
    for place in taken:
        np.minimum(out, np.sqrt(np.sum((space - space[place]) ** 2, axis=1)), out=out)
    return out


def apart(directions: Directions, place: int) -> Array:
    """How far (N,) directions are from one of them, degrees: the larger of incident and view angle."""
    vectors = view_vectors(directions)
    incident = np.abs(directions.theta_i - directions.theta_i[place])
    return np.asarray(np.maximum(incident, _angles_between(vectors, vectors[place])))


def uniform_start(directions: Directions, count: int) -> list[int]:
    """Return the first points: the mirror direction at three incident angles, then what is farthest away."""
    incident = np.unique(directions.theta_i)
    angles = mirror_angles(directions)
    taken: list[int] = []
    for k in np.linspace(0, len(incident) - 1, 3).round().astype(int):
        here = np.nonzero(directions.theta_i == incident[k])[0]
        taken.append(int(here[np.argmin(angles[here])]))
    space = coordinates(directions)
    left = nearest_taken(space, taken)
    while len(taken) < min(count, len(directions)):
        place = int(np.argmax(left))
        if left[place] == 0.0:
            break
        taken.append(place)
        np.minimum(left, np.sqrt(np.sum((space - space[place]) ** 2, axis=1)), out=left)
    return taken

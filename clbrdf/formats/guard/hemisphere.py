"""What a group of directions reflects in all, from below: no spike between two points counts.

On the disc of x = sinθ cosφ, y = sinθ sinφ the projected solid angle is the area: points are joined to
triangles, each with the mean of its corners, or with the least of them for a bound that a coarse grid about a
peak cannot lift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.guard.sample import Group

Array = npt.NDArray[np.float64]

MOST_POINTS = 20_000
ONE_SIDE = 0.02
"""Directions that lie on one side of the plane of incidence, up to rounding, stand for both."""

IN_PLANE = 12.0
"""Degrees about the plane of incidence."""


@dataclass(frozen=True)
class Total:
    """Reflectance of one incidence over the directions there are.

    Attributes
    ----------
    theta_i : float
        Degrees.
    mean : float
        ∫ f cosθ dΩ, linear between directions.
    low : float
        The same with the least corner of each triangle.
    coverage : float
        Share of the hemisphere's projected solid angle that was looked at.
    planar : bool
        Only the plane of incidence was measured: `mean` is that of the plane turned about the normal, and
        `low` a bound where the surface is darker in the plane than nowhere else.
    """

    theta_i: float
    mean: float
    low: float
    coverage: float
    planar: bool = False


def total_of(group: Group) -> Total | None:
    """Return what a group reflects; None where its directions span nothing."""
    values, theta, phi = group.bright, group.theta_r, group.phi
    if len(values) > MOST_POINTS:
        step = -(-len(values) // MOST_POINTS)
        values, theta, phi = values[::step], theta[::step], phi[::step]
    off = np.minimum(np.mod(phi, 180.0), 180.0 - np.mod(phi, 180.0))
    flat = off[theta > 1.0] <= IN_PLANE
    if flat.all():
        return _in_plane(group.theta_i, theta, np.cos(np.deg2rad(phi)) < 0.0, values)
    x, y = (np.sin(np.deg2rad(theta)) * f(np.deg2rad(phi)) for f in (np.cos, np.sin))
    if y.min() > -ONE_SIDE or y.max() < ONE_SIDE:
        x, y, values = np.tile(x, 2), np.concatenate([y, -y]), np.tile(values, 2)
    return _triangles(group.theta_i, x, y, values)


def _triangles(theta_i: float, x: Array, y: Array, values: Array) -> Total | None:
    from scipy.spatial import Delaunay, QhullError

    places, back, counts = np.unique(
        np.round(np.stack([x, y], axis=1), 9), axis=0, return_inverse=True, return_counts=True
    )
    mean = np.bincount(back.reshape(-1), values) / counts
    if len(places) < 4:
        return None
    try:
        corners = Delaunay(places).simplices
    except QhullError:
        return None
    a, b, c = (places[corners[:, k]] for k in range(3))
    area = 0.5 * np.abs((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))
    at = mean[corners]
    return Total(
        theta_i, float(area @ at.mean(axis=1)), float(area @ at.min(axis=1)), float(area.sum() / np.pi)
    )


def _in_plane(theta_i: float, theta: Array, ahead: npt.NDArray[np.bool_], values: Array) -> Total | None:
    """Turn the plane of incidence about the normal: its darker half-plane, from below.

    Where only one half-plane was measured, the other may be dark: there is no bound.
    """
    rings, back, counts = np.unique(np.round(theta, 3), return_inverse=True, return_counts=True)
    if len(rings) < 3:
        return None
    back = back.reshape(-1)
    mean = np.bincount(back, values) / counts
    least = np.full(len(rings), np.inf)
    np.minimum.at(least, back, values)
    sides = np.stack([np.bincount(back, ahead == side, len(rings)) for side in (True, False)])
    least[(sides == 0).any(axis=0) & (rings > 1.0)] = 0.0
    edges = np.sin(np.deg2rad(rings)) ** 2  # π sin²θ is the area of a disc
    width = np.pi * np.diff(edges)
    return Total(
        theta_i,
        float(width @ (mean[:-1] + mean[1:]) / 2.0),
        float(width @ np.minimum(least[:-1], least[1:])),
        float(edges[-1] - edges[0]),
        planar=True,
    )

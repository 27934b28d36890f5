"""Nodes and shares over the directions of a cone, on rings about its own axis: for smooth functions.

With t = 1 − cos r, in which equal steps are equal solid angles, Gauss-Legendre in t from 0 to 1 − cos R
sets n rings; each takes m equal azimuths, alternate rings turned by half a step. Polynomials up to degree
4n − 3 in the plane are integrated exactly by m = 4n − 2; one ring takes three nodes.

Source: Stroud, Approximate Calculation of Multiple Integrals (1971), section 8.1 (product rules for the
disc).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.instrument.vectors import tangents

Array = npt.NDArray[np.float64]


def ring_nodes(axis: Array, towards: Array, half_angle: Array, rings: int) -> tuple[Array, Array]:
    """Return nodes (N, K, 3) and shares (N, K), which add up to 1, over cones about axes (N, 3).

    The nodes are symmetric about the plane of each axis and `towards` (N, 3); half-angles (N,) are in
    radians.
    """
    t, weight = np.polynomial.legendre.leggauss(rings)
    t, weight = (t + 1.0) / 2.0, weight / 2.0
    count = 3 if rings == 1 else 4 * rings - 2
    azimuth = (np.arange(count) + 0.5 * (np.arange(rings)[:, None] % 2)) * (2.0 * np.pi / count)
    # 2 sin²(r/2) = 1 − cos r, without cancellation.
    radius = 2.0 * np.arcsin(np.sqrt(t) * np.sin(half_angle / 2.0)[:, None])
    first, second = tangents(axis, towards)
    sine, cosine = np.sin(radius)[..., None, None], np.cos(radius)[..., None, None]
    across = (
        np.cos(azimuth)[..., None] * first[:, None, None, :]
        + np.sin(azimuth)[..., None] * second[:, None, None, :]
    )
    nodes = cosine * axis[:, None, None, :] + sine * across
    shares = np.broadcast_to(np.repeat(weight / count, count), (len(axis), rings * count))
    return nodes.reshape(len(axis), -1, 3), np.array(shares)

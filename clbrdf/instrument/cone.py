"""Nodes and weights over the directions of a cone, placed for a lobe that is round about a known centre.

A reflection lobe depends above all on the angle from the mirror direction (2γ of the paper), so the rule is
a polar one about that centre C and not about the cone's own axis: with D the angle between centre and axis
and R the cone's half-angle,

    ∫ g dω = ∫ sin r dr ∫ g dψ,      |ψ| ≤ α(r),   tan²(α/2) = sin((R−r+D)/2) sin((R+r−D)/2)
                                                                  / (sin((r+D+R)/2) sin((r+D−R)/2))

(half-angle formula of the spherical triangle C, axis, rim). Where C lies inside the cone, the circles r < R
− D are whole and r = (R − D) s³ gathers the nodes at the lobe's tip; on the arcs r = lo + (hi − lo) s² (3 −
2s) takes the square roots out of both ends. Gauss-Legendre in s and ψ, equal steps on whole circles.

Source: Davis and Rabinowitz, Methods of Numerical Integration (2nd ed., 1984), 2.12 (changes of variable).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.instrument.vectors import tangents

Array = npt.NDArray[np.float64]

FARTHEST_CENTRE = np.pi / 2.0
"""A centre farther from the axis than this has no lobe to offer: the axis serves."""


def cone_nodes(axis: Array, centre: Array, half_angle: float | Array, order: int) -> tuple[Array, Array]:
    """Return nodes (N, K, 3) and weights (N, K) in sr over cones about axes (N, 3); K = 2 order².

    `centre` (N, 3) is where a lobe may peak, inside the cone or not; `half_angle`, one or (N,), is in
    radians, below π/2. The weights of a cone add up to its solid angle 2π (1 − cos R), to the accuracy of
    the rule.
    """
    half_angle = np.broadcast_to(np.asarray(half_angle, dtype=np.float64), len(axis))
    gap = angle_between(axis, centre)
    far = gap > FARTHEST_CENTRE
    centre = np.where(far[:, None], axis, centre)
    gap = np.where(far, 0.0, gap)
    inside = gap < half_angle
    radius, width, arc = _circles(gap, inside, half_angle, order)
    psi, psi_weight = _angles(arc, inside, order)
    first, second = tangents(centre, axis)
    sine, cosine = np.sin(radius)[..., None], np.cos(radius)[..., None]
    along, across = sine * np.cos(psi), sine * np.sin(psi)
    nodes = (
        cosine[..., None] * centre[:, None, None, :]
        + along[..., None] * first[:, None, None, :]
        + across[..., None] * second[:, None, None, :]
    )
    weights = (sine[..., 0] * width)[..., None] * psi_weight
    n = len(axis)
    return nodes.reshape(n, -1, 3), weights.reshape(n, -1)


def _circles(
    gap: Array, inside: npt.NDArray[np.bool_], half_angle: Array, order: int
) -> tuple[Array, Array, Array]:
    """Radii (N, 2 order) about the centre, their widths dr, and the half-angles α of arcs."""
    s, weight = np.polynomial.legendre.leggauss(order)
    s, weight = (s + 1.0) / 2.0, weight / 2.0
    low, high = np.abs(half_angle - gap)[:, None], (half_angle + gap)[:, None]
    # Inside, the first half of the nodes takes whole circles; outside, both halves share the arcs.
    share = np.where(inside, 1.0, 0.5)[:, None]
    places = np.concatenate([share * s, np.where(inside[:, None], s, 0.5 + 0.5 * s)], axis=1)
    widths = np.concatenate([share * weight, share * weight], axis=1)
    span = high - low
    radius = low + span * places**2 * (3.0 - 2.0 * places)
    width = widths * span * 6.0 * places * (1.0 - places)
    reach = (half_angle - gap)[inside, None]
    radius[inside, :order] = reach * s**3
    width[inside, :order] = reach * 3.0 * s**2 * weight
    d, half_angle = gap[:, None], half_angle[:, None]
    upper = np.sin((half_angle - radius + d) / 2.0) * np.sin((half_angle + radius - d) / 2.0)
    lower = np.sin((half_angle + radius + d) / 2.0) * np.sin((radius + d - half_angle) / 2.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        arc = 2.0 * np.arctan2(np.sqrt(np.maximum(upper, 0.0)), np.sqrt(np.maximum(lower, 0.0)))
    return radius, width, arc


def _angles(arc: Array, inside: npt.NDArray[np.bool_], order: int) -> tuple[Array, Array]:
    """Angles (N, 2 order, order) on each circle, and their weights."""
    t, weight = np.polynomial.legendre.leggauss(order)
    psi, psi_weight = arc[..., None] * t, arc[..., None] * weight
    even = (np.arange(order) + 0.5) * 2.0 * np.pi / order
    psi[inside, :order, :] = even
    psi_weight[inside, :order, :] = 2.0 * np.pi / order
    return psi, psi_weight


def angle_between(a: Array, b: Array) -> Array:
    """Angle between unit vectors (N, 3), radians, without cancellation."""
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))

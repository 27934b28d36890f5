"""Standard uncertainties at each point: counting, nonlinearity, readings, angles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import wrap_azimuth
from clbrdf.rig.kinematics import forward
from clbrdf.rig.rigfile import SpectrometerSettings
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

MEDIAN_OF_THREE = 1.0 - np.sqrt(3.0) / np.pi
"""Variance of the median of three standard normal values, 0.4487 (exact)."""

STEP = 1e-4
"""Step of the axes for the derivatives of the directions, degrees."""

FARTHEST = 5.0
"""Incident angles farther apart than this, degrees, say nothing about a slope: lobes are as narrow."""

SAME = 1e-3
"""Directions whose angles differ by less than this, degrees, count as equal."""


def count_variance(counts: Array, detector: SpectrometerSettings) -> Array:
    """Variance of the counts of one scan: counting, reading, and what grows with the signal."""
    charge = np.maximum(counts - detector.bias, 0.0)
    own = charge / detector.electrons_per_count + detector.read_noise**2
    return np.asarray(own + (detector.relative_noise * charge) ** 2)


def linearised(net: Array, coefficients: Array) -> tuple[Array, Array]:
    """Linear counts x / p(x) of net counts x, and their derivative (p − x p′) / p²."""
    if len(coefficients) == 0:
        return net, np.ones_like(net)
    polynomial = np.polynomial.Polynomial(coefficients)
    p, slope = polynomial(net), polynomial.deriv()(net)
    return net / p, (p - net * slope) / p**2


def angle_sigmas(scan: Scan, axes: Array, sigma: float) -> Array:
    """Return what an uncertainty of each axis, degrees, makes of the values: (3, N, W), 1/sr, signed.

    σ Σ_k ∂f/∂angle_k · ∂angle_k/∂axis for lamp, turn and pitch, with the angles θi, θr, φ: slopes from
    neighbouring points of the scan, derivatives of the angles from the kinematics.
    """
    slopes = local_slopes(scan)
    jacobian = _angle_derivatives(axes)
    return np.asarray(sigma * np.einsum("knw,nka->anw", slopes, jacobian))


def _angle_derivatives(axes: Array) -> Array:
    """∂(θi, θr, φ)/∂(lamp, turn, pitch), (N, 3, 3), by central differences of the kinematics."""
    jacobian = np.empty((len(axes), 3, 3))
    for k in range(3):
        step = np.zeros(3)
        step[k] = STEP
        after, before = forward(axes + step), forward(axes - step)
        turn = (after.phi_r - after.phi_i) - (before.phi_r - before.phi_i)
        turn = turn - 360.0 * np.round(turn / 360.0)
        # Through the normal the azimuth jumps by 180°; nothing depends on it there.
        turn[np.abs(turn) > 90.0] = 0.0
        differences = (after.theta_i - before.theta_i, after.theta_r - before.theta_r, turn)
        jacobian[:, :, k] = np.stack(differences, axis=-1) / (2.0 * STEP)
    return jacobian


def local_slopes(scan: Scan) -> Array:
    """∂f/∂(θi, θr, φ), (3, N, W), 1/sr per degree, from neighbours that differ in one angle only.

    Where a point has no neighbour in θi within 5°, −∂f/∂θr stands for it: a lobe follows the mirror
    direction.
    Without neighbours in φ the slope is 0, as it is in the plane of incidence by symmetry.
    """
    values = np.where(scan.mask, np.nan, scan.brdf)
    angles = np.stack([scan.theta_i, scan.theta_r, wrap_azimuth(scan.phi)], axis=-1)
    farthest = (FARTHEST, np.inf, np.inf)
    slopes = np.stack([_slope(angles, k, values, farthest[k]) for k in range(3)])
    slopes[1] = np.nan_to_num(slopes[1], nan=0.0)
    slopes[0] = np.where(np.isnan(slopes[0]), -slopes[1], slopes[0])
    slopes[2] = np.nan_to_num(slopes[2], nan=0.0)
    return slopes


def _slope(angles: Array, which: int, values: Array, farthest: float) -> Array:
    """Slope (N, W) along one angle among the points that agree in the other two.

    NaN where a point is alone, or its nearest neighbour is farther away than `farthest`, degrees.
    """
    out = np.full(values.shape, np.nan)
    others = np.round(np.delete(angles, which, axis=1) / SAME).astype(np.int64)
    _, groups = np.unique(others, axis=0, return_inverse=True)
    order = np.argsort(groups, kind="stable")
    for members in np.split(order, np.nonzero(np.diff(groups[order]))[0] + 1):
        places, back = np.unique(np.round(angles[members, which] / SAME), return_inverse=True)
        if len(places) < 2:
            continue
        # Repeats of a direction count with their mean.
        counts = np.bincount(back)
        means = np.stack(
            [np.bincount(back, values[members, w]) / counts for w in range(values.shape[1])], axis=-1
        )
        slope = np.gradient(means, places * SAME, axis=0)
        gaps = np.diff(places) * SAME
        nearest = np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))
        slope[nearest > farthest] = np.nan
        out[members] = slope[back]
    return out

"""A grid about the specular direction, refined until values between its nodes are within a tolerance.

The grid has incident zeniths, azimuths and radial angles about the specular direction. What a reader makes of
it by interpolating linearly is held against the BRDF in random directions, half of them near the mirror
direction; the axis whose refinement helps most is refined, until Σ|error|/Σ is within the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.vectors import from_specular, to_specular
from clbrdf.geometry import Directions

Array = npt.NDArray[np.float64]
Brdf = Callable[[Directions], Array]
"""Directions (N) -> (N, W), 1/sr."""

CHECKS = 3000
MOST_NODES = 3_000_000
"""Nodes times wavelengths."""

FIRST, LAST, LARGEST_VIEW = 3.0, 80.0, 85.0
"""Degrees: incident zeniths that are checked, and the largest view zenith."""

START = (
    np.array([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0]),
    np.linspace(0.0, 180.0, 13),
    np.array([0.0, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 110.0, 140.0, 175.0]),
)
ON_HORIZON = 90.0 - 1e-6


@dataclass(frozen=True, eq=False)
class Grown:
    """A grid and how well it holds a BRDF.

    Attributes
    ----------
    directions : Directions
        Its nodes above the horizon, φi = 0.
    values : (N, W) float64
        1/sr.
    shape : (int, int, int)
        Incident zeniths, azimuths, radial angles.
    reached : float
        Σ|error|/Σ in the directions that were checked, at the worst wavelength.
    rounds : int
    """

    directions: Directions
    values: Array
    shape: tuple[int, int, int]
    reached: float
    rounds: int


def grow(brdf: Brdf, tolerance: float, seed: int = 0) -> Grown:
    """Return a grid that holds a BRDF within a tolerance, or the finest one that is made."""
    checks = check_directions(seed)
    truth = brdf(checks)
    axes, cache = list(START), {}

    def error(candidate: list[Array]) -> float:
        key = tuple(len(axis) for axis in candidate)
        if key not in cache:
            cache[key] = _error(brdf, candidate, checks, truth)
        return cache[key]

    rounds = 1
    while error(axes) > tolerance:
        options = [[_halved(a) if k == which else a for k, a in enumerate(axes)] for which in range(3)]
        options = [c for c in options if np.prod([len(a) for a in c]) * truth.shape[1] <= MOST_NODES]
        if not options:
            break
        # What a refinement gains, for the nodes that it costs.
        gains = [np.log(error(axes) / max(error(c), 1e-12)) / np.log(_size(c) / _size(axes)) for c in options]
        axes = options[int(np.argmax(gains))]
        rounds += 1
        if max(gains) <= 0.0:
            break
    nodes, above = _nodes(axes)
    kept = nodes[above & _first_of_centre(axes)]
    shape = (len(axes[0]), len(axes[1]), len(axes[2]))
    return Grown(kept, brdf(kept), shape, error(axes), rounds)


def check_directions(seed: int) -> Directions:
    """Return random directions, half of them within some degrees of the mirror direction."""
    rng = np.random.default_rng(seed)
    theta_i = rng.uniform(FIRST, LAST, CHECKS)
    near = rng.random(CHECKS) < 0.5
    radial = np.where(near, rng.exponential(4.0, CHECKS), rng.uniform(0.0, 90.0, CHECKS))
    theta_r, phi = from_specular(theta_i, rng.uniform(0.0, 180.0, CHECKS), np.minimum(radial, 175.0))
    keep = theta_r <= LARGEST_VIEW
    return Directions.relative(theta_i[keep], theta_r[keep], phi[keep])


def _size(axes: list[Array]) -> float:
    return float(np.prod([len(axis) for axis in axes]))


def _halved(axis: Array) -> Array:
    return np.sort(np.concatenate([axis, (axis[1:] + axis[:-1]) / 2.0]))


def _nodes(axes: list[Array]) -> tuple[Directions, npt.NDArray[np.bool_]]:
    """Return directions of all nodes, any for those below the horizon, and which lie above it."""
    theta_i, azimuth, radial = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    theta_r, phi = from_specular(theta_i, azimuth, radial)
    above = theta_r < ON_HORIZON
    return Directions.relative(theta_i, np.where(above, theta_r, 0.0), phi), above


def _first_of_centre(axes: list[Array]) -> npt.NDArray[np.bool_]:
    """Return True but where the centre stands again for another azimuth."""
    keep = np.ones([len(axis) for axis in axes], dtype=bool)
    keep[:, 1:, axes[2] == 0.0] = False
    return keep.ravel()


def _error(brdf: Brdf, axes: list[Array], checks: Directions, truth: Array) -> float:
    from scipy.interpolate import RegularGridInterpolator

    nodes, above = _nodes(axes)
    # Files pad what lies below the horizon with 0, and readers interpolate towards it.
    values = np.where(above[:, None], brdf(nodes), 0.0).reshape(*(len(axis) for axis in axes), -1)
    azimuth, radial = to_specular(checks.theta_i, checks.theta_r, checks.phi)
    folded = np.minimum(azimuth, 360.0 - azimuth)
    places = np.stack([checks.theta_i, folded, np.minimum(radial, axes[2][-1])], axis=1)
    found = RegularGridInterpolator(tuple(axes), values)(places)
    total = np.abs(truth).sum(axis=0)
    return float(np.max(np.abs(found - truth).sum(axis=0) / np.where(total > 0.0, total, 1.0)))

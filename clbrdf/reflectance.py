"""Directional-hemispherical reflectance: how much of what comes in leaves, up to a stated zenith.

    ρ(θi) = ∫∫ f_r(θi, θr, φ) cosθr sinθr dθr dφ,  θr from 0 to a stated largest zenith

The integral is cut there because the model of Wang, Zhang and Dong diverges towards grazing whenever
k_s > 0: G cosθr / cosθr grows like tanθr. Say the cut with the value.

Panels of Gauss-Legendre points are graded geometrically around the mirror direction, so that a lobe of a
hundredth of a degree is met as well as a broad one; the cusp of the lobe for d < 1/2 lies on a corner of
the panels. Source: Davis and Rabinowitz, Methods of Numerical Integration (2nd ed., 1984), 2.7 and 2.12.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.evaluate import evaluate
from clbrdf.geometry import Directions, check_zenith
from clbrdf.models import DEFAULT_MODEL

Array = npt.NDArray[np.float64]

GRADING = 3.0
SMALLEST_PANEL = 1e-4
"""Degrees; the panels next to the mirror direction are about this wide."""


@dataclass(frozen=True, eq=False)
class HemisphereGrid:
    """Quadrature over view directions for one incident zenith.

    Attributes
    ----------
    theta_r, phi : (N,) float64
        Degrees.
    weight : (N,) float64
        Projected solid angle cosθr sinθr dθr dφ of each direction, sr.
    """

    theta_r: Array
    phi: Array
    weight: Array


def graded_grid(theta_i: float, max_zenith: float, points: int) -> HemisphereGrid:
    """Return a grid of panels graded around the mirror direction, `points` Gauss points a panel and axis.

    The azimuth runs over half the circle, φ from 0 to 180°, with doubled weights: isotropic models are
    even in φ.
    """
    theta, theta_weight = _panels(_edges(0.0, max_zenith, theta_i), points)
    phi, phi_weight = _panels(_edges(0.0, 180.0, 180.0), points)
    return _product(theta, theta_weight, phi, 2.0 * phi_weight)


def uniform_grid(max_zenith: float, points: int) -> HemisphereGrid:
    """Return midpoints of a uniform grid, `points` in zenith and 2 × `points` in azimuth, as a scan has."""
    theta = (np.arange(points) + 0.5) * max_zenith / points
    phi = (np.arange(2 * points) + 0.5) * 180.0 / points
    return _product(theta, np.full(points, max_zenith / points), phi, np.full(2 * points, 180.0 / points))


def _product(theta: Array, theta_weight: Array, phi: Array, phi_weight: Array) -> HemisphereGrid:
    radians = np.deg2rad(theta)
    ring = np.sin(radians) * np.cos(radians) * np.deg2rad(theta_weight)
    return HemisphereGrid(
        np.repeat(theta, len(phi)),
        np.tile(phi, len(theta)),
        np.outer(ring, np.deg2rad(phi_weight)).ravel(),
    )


def _edges(low: float, high: float, centre: float) -> Array:
    """Edges of panels from low to high that shrink geometrically towards a centre on both sides."""
    reach = max(high - low, SMALLEST_PANEL)
    steps = reach / GRADING ** np.arange(np.ceil(np.log(reach / SMALLEST_PANEL) / np.log(GRADING)) + 1.0)
    edges = np.concatenate([[low, high, centre], centre - steps, centre + steps])
    return np.unique(edges[(edges >= low) & (edges <= high)])


def _panels(edges: Array, points: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on each panel, joined."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    half = np.diff(edges)[:, None] / 2.0
    middle = (edges[:-1] + edges[1:])[:, None] / 2.0
    return (middle + half * nodes).ravel(), (half * weights).ravel()


def directional_hemispherical_reflectance(
    parameters: Mapping[str, npt.ArrayLike],
    theta_i: float,
    *,
    max_zenith: float = 85.0,
    points: int = 12,
    model: str = DEFAULT_MODEL,
    precision: str = "double",
) -> Array:
    """Return ρ(θi) up to a largest view zenith, for one parameter set or W of them.

    Parameters
    ----------
    parameters : mapping of str to float or (W,) array
    theta_i : float
        Incident zenith, degrees, [0, 90).
    max_zenith : float
        Where the integral is cut, degrees, (0, 90].
    points : int
        Gauss points a panel and axis: 12 give about 1e-8 relative for lobes wider than 0.01°.
    model, precision : str

    Returns
    -------
    () or (W,) float64
        1 for a surface that reflects all it receives; the model may give more.

    Raises
    ------
    InputError
        Angles out of range, or as `evaluate`.
    """
    check_zenith("theta_i", np.atleast_1d(np.asarray(theta_i, dtype=np.float64)))
    if not 0.0 < max_zenith <= 90.0:
        raise InputError(f"max_zenith is {max_zenith:g}°; it lies in (0°, 90°]")

    def brdf(directions: Directions) -> Array:
        angles = directions.theta_i, directions.theta_r, directions.phi
        return evaluate(parameters, *angles, model=model, precision=precision)

    return hemispherical_integral(brdf, theta_i, max_zenith, points)


def hemispherical_integral(
    brdf: Callable[[Directions], Array], theta_i: float, max_zenith: float, points: int
) -> Array:
    """Return ρ(θi), () or (W,), of any BRDF: directions (N) -> (N,) or (N, W), even in φ.

    The angles are as in `directional_hemispherical_reflectance`, and not checked here.
    """
    grid = graded_grid(float(theta_i), float(max_zenith), points)
    values = brdf(Directions.relative(np.full(1, theta_i), grid.theta_r, grid.phi))
    # Not by BLAS, whose last digits depend on how many threads it has.
    return np.asarray((grid.weight * values.T).sum(axis=-1))

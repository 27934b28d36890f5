"""Whether a surface conserves energy and is reciprocal, in figures and in plain words.

Directional-hemispherical reflectance: `clbrdf.reflectance`. Reciprocity (Helmholtz): source and detector
may change places, f_r(θi, θr, φ) = f_r(θr, θi, φ); Table 1 of Wang, Zhang and Dong (2013) does neither,
since F (12) depends on the incident angle alone and the amplitudes describe curves measured in plane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.reflectance import hemispherical_integral
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]
Brdf = Callable[[Directions], Array]
"""Directions (N) -> (N, W), 1/sr."""

CUT = 85.0
"""Degrees; where the integral of a surface with a specular part ends."""

POINTS = 6
"""Gauss points a panel: 1e-6 relative for the lobes of Table 1 (tests/scene)."""

EXCHANGED_ZENITHS = tuple(5.0 * k for k in range(18))
EXCHANGED_AZIMUTHS = (0.0, 45.0, 90.0, 135.0, 180.0)

ENERGY_MARGIN = 1e-9
RECIPROCITY_MARGIN = 1e-4
"""Ratios nearer to 1 are rounding, or single precision's."""


@dataclass(frozen=True, eq=False)
class Reflectance:
    """ρ (I, W) at incident zeniths (I,), integrated to a largest view zenith, degrees."""

    theta_i: Array
    max_zenith: float
    values: Array


@dataclass(frozen=True)
class Exchange:
    """The exchange of source and detector that changes the BRDF most.

    Attributes
    ----------
    factor : float
        Larger of the two values over the smaller; 1 for a reciprocal surface.
    theta_1, theta_2, phi : float
        Degrees.
    wavelength : float
        nm.
    """

    factor: float
    theta_1: float
    theta_2: float
    phi: float
    wavelength: float


def reflectance_of(brdf: Brdf, theta_i: Array, diverges: bool, points: int = POINTS) -> Reflectance:
    """Integrate a surface over view directions, to 90° where that has a bound and to 85° else."""
    cut = CUT if diverges else 90.0
    values = [hemispherical_integral(brdf, float(angle), cut, points) for angle in theta_i]
    return Reflectance(np.asarray(theta_i, dtype=np.float64), cut, np.array(values))


def worst_exchange(brdf: Brdf, wavelength: Array) -> Exchange:
    """Exchange source and detector on a grid of directions; return the pair that differs most."""
    pairs = list(product(combinations(EXCHANGED_ZENITHS, 2), EXCHANGED_AZIMUTHS))
    one = np.array([angles[0] for angles, _ in pairs])
    two = np.array([angles[1] for angles, _ in pairs])
    phi = np.array([azimuth for _, azimuth in pairs])
    directions = Directions.relative(one, two, phi)
    return _worst(brdf(directions), brdf(Directions.relative(two, one, phi)), directions, wavelength)


def _worst(there: Array, back: Array, directions: Directions, wavelength: Array) -> Exchange:
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(there > back, there / back, back / there)
    factor = np.where(np.isnan(factor), 1.0, factor)
    k, w = np.unravel_index(int(np.argmax(factor)), factor.shape)
    one, two, phi = (float(a[k]) for a in (directions.theta_i, directions.theta_r, directions.phi))
    return Exchange(float(factor[k, w]), one, two, phi, float(wavelength[w]))


def measured_exchange(scan: Scan) -> Exchange | None:
    """Return the measured exchange that differs most; None where no direction was measured both ways."""
    values = np.where(scan.mask, np.nan, scan.brdf)
    folded = np.minimum(scan.phi, 360.0 - scan.phi)
    rows = np.round(np.stack([scan.theta_i, scan.theta_r, folded], axis=1), 6)
    places = {(i, r, phi): n for n, (i, r, phi) in enumerate(rows.tolist())}
    pairs = [(n, places.get((r, i, phi))) for (i, r, phi), n in places.items() if i < r]
    found = [(one, other) for one, other in pairs if other is not None]
    if not found:
        return None
    one, other = np.array(found).T
    return _worst(values[one], values[other], scan.directions[one], scan.wavelength)


def energy_words(reflectance: Reflectance, wavelength: Array) -> str:
    """Say whether a surface reflects more than it receives."""
    values = np.where(np.isnan(reflectance.values), -np.inf, reflectance.values)
    k, w = np.unravel_index(int(np.argmax(values)), values.shape)
    largest = float(values[k, w])
    place = f"at θi = {reflectance.theta_i[k]:g}°{_at(wavelength[w], ' and ')}"
    if not np.isfinite(largest):
        return "the reflectance is not known"
    if largest > 1.0 + ENERGY_MARGIN:
        return f"reflects more than it receives: {largest:.4g} times as much {place}"
    return f"reflects no more than it receives: at most {largest:.4g} of it, {place}"


def cut_words(reflectance: Reflectance) -> str:
    """Say where the integral ends, and why."""
    if reflectance.max_zenith < 90.0:
        return (
            f"integrated to θr = {reflectance.max_zenith:g}°: with a specular part the integral diverges"
            " towards 90°, so the cut belongs to the value"
        )
    return "integrated over the whole hemisphere, to θr = 90°"


def reciprocity_words(exchange: Exchange) -> str:
    """Say whether source and detector may change places."""
    if exchange.factor - 1.0 <= RECIPROCITY_MARGIN:
        return "reciprocal: source and detector may change places"
    return (
        f"not reciprocal: with source and detector exchanged the BRDF changes by a factor of up to"
        f" {exchange.factor:.4g}, between {exchange.theta_1:g}° and {exchange.theta_2:g}°"
        f" (φ = {exchange.phi:g}°{_at(exchange.wavelength, ', ')})"
    )


def _at(wavelength: float, joint: str) -> str:
    """Return a wavelength, nm, after a joint; nothing of a band, which has none."""
    return f"{joint}{wavelength:g} nm" if np.isfinite(wavelength) else ""

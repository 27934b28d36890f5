"""What is exported: any isotropic BRDF that can be evaluated in every direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

Brdf = Callable[[Array, Array, Array, Places], Array]
"""θi, θr, φ (N,), degrees, 180 forward, and places of bands (V,) -> (N, V), 1/sr without the cosine."""

MOST_STEERING_BANDS = 4

GRAZING = np.deg2rad(89.9)
"""Where values at the horizon are taken: models may divide by the cosine."""

LARGEST_INCIDENT = np.deg2rad(89.5)

REFLECTION_DEPTH = 0.2
"""Cosine below the horizon down to which values are continued by reflection; constant beyond."""


@dataclass(frozen=True, eq=False)
class Material:
    """An isotropic BRDF with W bands.

    Attributes
    ----------
    brdf : callable
        See `Brdf`.
    wavelength : (W,) float64 or None
        nm; None for three bands of linear sRGB.
    description : str
        Goes into the file.
    """

    brdf: Brdf
    wavelength: Array | None
    description: str = ""

    @property
    def bands(self) -> int:
        """How many."""
        return 3 if self.wavelength is None else len(self.wavelength)

    @property
    def every_band(self) -> Places:
        """Places of all bands."""
        return np.arange(self.bands)

    @property
    def steering_bands(self) -> Places:
        """Places of a few bands, spread, that stand for all where a grid is chosen."""
        count = min(self.bands, MOST_STEERING_BANDS)
        return np.unique(np.linspace(0, self.bands - 1, count).round().astype(np.intp))


def projected(material: Material, bands: Places, theta_i: float, cosine: Array, phi: Array) -> Array:
    """Return f·cosθr, (..., V), also below the horizon, where it is continued.

    A renderer returns 0 there, but interpolates across it: a jump or a kink at the horizon would spoil
    the last cell above. With h(c) = f·cosθr at c = cosθr the continuation is 2 h(0) − h(−c), which keeps
    value and slope, up to where it would change its sign: a BRDF that is nowhere negative is not so in the
    file either.

    Parameters
    ----------
    theta_i : float
        Radians; values beyond 89.5° are those of 89.5°.
    cosine : (...) array
        Of the view zenith, [−1, 1].
    phi : (...) array
        φr − φi, radians.
    """
    incident = np.full(cosine.size, np.rad2deg(min(theta_i, LARGEST_INCIDENT)))
    azimuth = np.rad2deg(phi).ravel()
    lowest = np.cos(GRAZING)

    def at(c: Array, chosen: npt.NDArray[np.bool_] | slice) -> Array:
        c = np.clip(c, lowest, 1.0)
        values = material.brdf(incident[chosen], np.rad2deg(np.arccos(c)), azimuth[chosen], bands)
        return np.nan_to_num(values, posinf=0.0, neginf=0.0) * c[:, None]

    c = cosine.ravel()
    out = at(np.where(c > 0.0, c, np.minimum(-c, REFLECTION_DEPTH)), slice(None))
    below = c <= 0.0
    if below.any():
        mirrored = out[below]
        continued = 2.0 * at(np.zeros(below.sum()), below) - mirrored
        out[below] = np.where(continued * mirrored > 0.0, continued, 0.0)
    return out.reshape(*cosine.shape, len(bands))

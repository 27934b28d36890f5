"""How far the BRDF read off an RGL file is from the one that was to be written."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.rgl.coordinates import reflected
from clbrdf.formats.rgl.material import Material, Places
from clbrdf.formats.rgl.values import TensorReader

Array = npt.NDArray[np.float64]

FIRST_INCIDENT, LAST_INCIDENT = 3.0, 80.0
"""Degrees: the incident zeniths for which a tolerance holds."""

LARGEST_VIEW = 85.0
"""Degrees. Beyond, f = (f·cosθr)/cosθr multiplies by more than 11 what no picture shows."""

NEAREST_HALF, FARTHEST_HALF = 0.05, 10.0
"""Degrees between half vector and normal, for the half of the directions around the mirror direction."""


LIGHT_PART = 3.0
"""By how much the error of the light over the hemisphere may exceed the tolerance."""


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Errors of a file, each Σ|error| / Σ|f|, over directions and as said.

    Attributes
    ----------
    theta_i : (T,) float64
        Incident zeniths, degrees.
    by_band : (W,) float64
        Over all directions.
    by_incident : (T,) float64
        Over view directions and bands.
    size_by_incident : (T,) float64
        Σ|f|, 1/sr.
    together : float
        Over all directions and bands.
    light : float
        Σ|error|·cosθr / Σ|f|·cosθr over the half that is uniform over the hemisphere, at the worst band or
        over the bands of RGB together: what of the reflected light is wrong.
    directions : int
        How many.
    rgb : bool
        Whether the bands are those of linear sRGB.
    """

    theta_i: Array
    by_band: Array
    by_incident: Array
    size_by_incident: Array
    together: float
    light: float
    directions: int
    rgb: bool

    @property
    def reached(self) -> float:
        """What a tolerance is held against: the worst wavelength, or the three bands of RGB together.

        A band of RGB is no quantity of its own: it can pass through 0.
        """
        return self.together if self.rgb else float(self.by_band.max())

    @property
    def binding(self) -> float:
        """What has to be within a tolerance: `reached`, or a third of `light` where that is more.

        In the sum over all directions a narrow lobe outweighs everything beside it.
        """
        return max(self.reached, self.light / LIGHT_PART)

    @property
    def worst_incident(self) -> tuple[float, float]:
        """Incident zenith, degrees, with the largest error, and that error."""
        worst = int(np.argmax(self.by_incident))
        return float(self.theta_i[worst]), float(self.by_incident[worst])


def check_directions(theta_i: Array, views: int, seed: int) -> tuple[Array, Array, Array]:
    """Return views (T × views,) for each incident zenith (T,): θi, θr, φ in degrees.

    Half are uniform over the hemisphere up to 85°, half around the mirror direction: the half vector is
    up to 10° from the normal, its distance uniform in the logarithm from 0.05°.
    """
    rng = np.random.default_rng(seed)
    shape = (len(theta_i), views)
    cosine = 1.0 - rng.random(shape) * (1.0 - np.cos(np.deg2rad(LARGEST_VIEW)))
    theta_r, phi = np.rad2deg(np.arccos(cosine)), 360.0 * rng.random(shape)
    near = views // 2
    low, high = np.log(np.deg2rad([NEAREST_HALF, FARTHEST_HALF]))
    theta_m = np.exp(rng.uniform(low, high, (len(theta_i), near)))
    phi_m = rng.uniform(0.0, 2.0 * np.pi, theta_m.shape)
    _, cosine, azimuth = reflected(np.deg2rad(theta_i)[:, None], theta_m, phi_m)
    seen = cosine > np.cos(np.deg2rad(LARGEST_VIEW))
    theta_r[:, :near][seen] = np.rad2deg(np.arccos(cosine[seen]))
    phi[:, :near][seen] = np.rad2deg(azimuth[seen])
    return np.repeat(theta_i, views), theta_r.ravel(), phi.ravel()


def measure_accuracy(
    material: Material, reader: TensorReader, bands: Places, theta_i: Array, views: int, seed: int = 0
) -> Accuracy:
    """Compare a file with its material.

    Parameters
    ----------
    reader : TensorReader
        Of tables that hold the bands given, in this order.
    theta_i : (T,) array
        Degrees.
    """
    angles = check_directions(theta_i, views, seed)
    error, size = np.zeros((len(theta_i), len(bands))), np.zeros((len(theta_i), len(bands)))
    lit = np.zeros((2, len(bands)))
    rows = max(1, 2_000_000 // (views * len(bands)))
    for start in range(0, len(theta_i), rows):
        block = slice(start * views, (start + rows) * views)
        part = [a[block] for a in angles]
        truth = material.brdf(part[0], part[1], part[2], bands)
        away = np.abs(reader.brdf(*part) - truth)
        weight = np.cos(np.deg2rad(part[1])).reshape(-1, views)[:, views // 2 :, None]
        for k, values in enumerate((away, np.abs(truth))):
            lit[k] += (weight * values.reshape(-1, views, len(bands))[:, views // 2 :]).sum(axis=(0, 1))
        error[start : start + rows] = away.reshape(-1, views, len(bands)).sum(axis=1)
        size[start : start + rows] = np.abs(truth).reshape(-1, views, len(bands)).sum(axis=1)
    tiny = np.finfo(np.float64).tiny
    rgb = material.wavelength is None
    if rgb:
        lit = lit.sum(axis=1, keepdims=True)
    return Accuracy(
        theta_i=theta_i,
        by_band=error.sum(axis=0) / np.maximum(size.sum(axis=0), tiny),
        by_incident=error.sum(axis=1) / np.maximum(size.sum(axis=1), tiny),
        size_by_incident=size.sum(axis=1),
        together=float(error.sum() / max(size.sum(), tiny)),
        directions=len(angles[0]),
        light=float((lit[0] / np.maximum(lit[1], tiny)).max()),
        rgb=rgb,
    )


def random_incidents(count: int, seed: int) -> Array:
    """Return incident zeniths for which a tolerance holds, (count,), increasing, degrees."""
    rng = np.random.default_rng(seed)
    # One in each of equal parts, so that none is left out.
    parts = (np.arange(count) + rng.random(count)) / count
    return np.asarray(FIRST_INCIDENT + parts * (LAST_INCIDENT - FIRST_INCIDENT))

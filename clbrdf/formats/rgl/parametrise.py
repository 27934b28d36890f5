"""From a BRDF to the tables of an RGL file.

The format leaves the tables that place the samples free, as long as the spectra are computed for them:
whatever `vndf`, `ndf` and `sigma` hold, reading at a stored sample gives the BRDF there. Between the
samples the error is that of linear interpolation, so the tables are chosen to make the spectra smooth:

`vndf`
    For each incident zenith and each azimuth of half vectors a density over their zenith: a share
    follows the BRDF itself, so that the lobe is met by as many samples whatever its width, and the rest
    covers what is beside it. Each azimuth holds the same total, so that azimuths are sampled evenly and
    the sample of a direction far from the lobe does not move when the lobe changes. Half vectors that
    reflect below the horizon get none.
`ndf`
    The slowest decrease of the lobe over the incident zeniths.
`sigma`
    Between incident zeniths that are stored, what brings the interpolated values closest to the BRDF: a
    curvature over θi that all directions share costs nothing.

Each of them departs from the physical meaning that the database gives these tables, and none changes
what a program that reads them computes. Decision 0070.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.rgl.coordinates import azimuth_of, horizon, reflected, zenith_coordinate, zenith_of
from clbrdf.formats.rgl.material import LARGEST_INCIDENT, Material, Places, projected
from clbrdf.formats.rgl.tables import Single, Tables
from clbrdf.formats.rgl.values import TensorReader
from clbrdf.formats.rgl.warp import Warp

Array = npt.NDArray[np.float64]

PROFILE_INCIDENTS = np.deg2rad([10.0, 25.0, 40.0, 55.0, 70.0])
PROFILE_NODES = 512
PROFILE_AZIMUTHS = 64
PROFILE_FLOOR = 0.03
"""Of the peak: a steeper profile only moves the steepness into the spectra beside the lobe."""

BESIDE = 0.5
"""Share of the samples that does not follow the BRDF."""

FOLLOWED = 1.0 / 3.0
"""Power of BRDF and solid angle that the others follow: the rule of `incidence`."""

SMALLEST_COSINE = 0.15
"""Divisor of f·cosθr where the density follows it: samples must not thin out towards the horizon."""

BEYOND_HORIZON = np.deg2rad(2.0)
"""How far densities go on beyond the horizon: it moves between two stored incident zeniths."""

AZIMUTHS, ZENITHS = 32, 64
"""Nodes of `vndf`; more do not lower the error, for any smooth map will do."""

SIGMA_NODES = 256
GAIN_SAMPLES, GAIN_BANDS, GAIN_BLOCK = 16, 3, 32
LEAST_LUMINANCE = 1e-4


@dataclass(frozen=True, eq=False)
class TableLayout:
    """Where values are stored.

    Attributes
    ----------
    theta_i : (K,) float64
        Incident zeniths, radians, increasing from 0.
    side : int
        Samples are side × side for each of them.
    """

    theta_i: Array
    side: int


def lobe_profile(material: Material) -> Array:
    """Return the slowest decrease of the lobe over half-vector zenith, (PROFILE_NODES,), peak 1.

    For each of a few incident zeniths, f·cosθr averaged over azimuths, scaled to its peak; the largest of
    these, not increasing. Where too few azimuths reflect above 87° the last value holds.

    Raises
    ------
    InputError
        The BRDF is nowhere positive.
    """
    theta_m = zenith_of(np.linspace(0.0, 1.0, PROFILE_NODES))[:, None]
    phi_m = (np.arange(PROFILE_AZIMUTHS) + 0.5)[None, :] / PROFILE_AZIMUTHS * 2.0 * np.pi
    best = np.zeros(PROFILE_NODES)
    for theta_i in PROFILE_INCIDENTS:
        dot, cosine, phi = reflected(theta_i, theta_m, phi_m)
        valid = (dot > 0.0) & (cosine > np.cos(np.deg2rad(87.0)))
        values = np.where(valid, _steer(material, theta_i, cosine, phi), 0.0)
        count = valid.sum(axis=1)
        mean = values.sum(axis=1) / np.maximum(count, 1)
        last = int(np.flatnonzero(count >= PROFILE_AZIMUTHS // 4)[-1])
        mean[last:] = mean[last]
        best = np.maximum(best, mean / max(mean.max(), np.finfo(float).tiny))
    if not best.max() > 0.0:
        raise InputError("the BRDF is nowhere positive; there is nothing to export")
    return np.minimum.accumulate(np.maximum(best, PROFILE_FLOOR))


def make_tables(
    material: Material, layout: TableLayout, profile: Array, bands: Places | None = None
) -> Tables:
    """Return the tables of a layout.

    Parameters
    ----------
    profile : (A,) array
        From `lobe_profile`.
    bands : (V,) array of int, optional
        Bands that the tables hold; all if not given.
    """
    chosen = material.every_band if bands is None else bands
    shares = np.linspace(0.0, 1.0, layout.side)
    theta_i = np.minimum(layout.theta_i, LARGEST_INCIDENT).astype(np.float32).astype(np.float64)
    vndf = np.array([_density(material, t) for t in theta_i], dtype=np.float32)
    warp = Warp.of(vndf)
    spectra = np.empty((len(theta_i), len(chosen), layout.side, layout.side), dtype=np.float32)
    luminance = np.empty((len(theta_i), layout.side, layout.side), dtype=np.float32)
    ndf = profile.astype(np.float32)
    steps = np.linspace(0.0, 1.0, len(ndf))
    for k, incident in enumerate(theta_i):
        x, y = warp.place(k, shares, shares)
        theta_m = zenith_of(x)
        dot, cosine, phi = reflected(incident, theta_m, azimuth_of(y)[:, None])
        values = projected(material, chosen, incident, cosine, phi)
        spectra[k] = np.moveaxis(values * (4.0 / np.interp(x, steps, ndf))[..., None], -1, 0)
        # What random sampling by `vndf` alone leaves to be done: f·cosθr over its density of directions.
        # Below the horizon, too: what is interpolated across it must not become rare and heavy.
        needed = np.abs(values).mean(axis=-1) * _solid_angle(x, theta_m, dot) / _at(warp.density[k], x, y)
        luminance[k] = np.maximum(needed, LEAST_LUMINANCE * needed.max())
    sigma = np.cos(np.minimum(zenith_of(np.linspace(0.0, 1.0, SIGMA_NODES)), np.deg2rad(89.0)))

    def tables(sigma: Array, spectra: Single, wavelength: Single | None) -> Tables:
        area = sigma.astype(np.float32)
        grid = np.linspace(0.0, 1.0, SIGMA_NODES)
        scale = np.interp(zenith_coordinate(theta_i), grid, area).astype(np.float32)
        return Tables(
            description=material.description,
            phi_i=np.zeros(1, np.float32),
            theta_i=theta_i.astype(np.float32),
            ndf=np.stack([ndf, ndf]),
            sigma=np.stack([area, area]),
            vndf=vndf[None],
            luminance=luminance[None],
            spectra=(spectra * scale[:, None, None, None])[None],
            wavelength=wavelength,
        )

    # Gains are those of a few bands, whatever the file holds.
    few = np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), GAIN_BANDS)).round().astype(np.intp))
    numbers = np.arange(1, len(few) + 1, dtype=np.float32)
    sigma = sigma / _gains(material, chosen[few], tables(sigma, spectra[:, few], numbers), warp)
    wavelength = None if material.wavelength is None else material.wavelength[chosen].astype(np.float32)
    return tables(sigma, spectra, wavelength)


def _density(material: Material, theta_i: float) -> Array:
    """Density of samples over (azimuth, zenith) of half vectors, each azimuth with the same total."""
    u = np.linspace(0.0, 1.0, ZENITHS)
    theta_m, phi_m = zenith_of(u)[None, :], azimuth_of(np.linspace(0.0, 1.0, AZIMUTHS))[:, None]
    dot, cosine, phi = reflected(theta_i, theta_m, phi_m)
    inside = theta_m < horizon(np.asarray(theta_i), phi_m) + BEYOND_HORIZON
    raised = np.maximum(np.where(cosine > 0.0, cosine, np.minimum(-cosine, SMALLEST_COSINE)), 2e-3)
    follows = _steer(material, theta_i, raised, phi) / np.maximum(raised, SMALLEST_COSINE)
    lobe = np.where(inside, (follows * _solid_angle(u[None, :], theta_m, dot)) ** FOLLOWED, 0.0)
    beside = np.where(inside, 0.5 + u[None, :], 0.0)
    return _rows_of_one((1.0 - BESIDE) * _rows_of_one(lobe) + BESIDE * _rows_of_one(beside))


def _rows_of_one(values: Array) -> Array:
    """Scale rows so that their trapezoids sum to one; rows of zeros become even."""
    total = (values[:, 1:] + values[:, :-1]).sum(axis=1, keepdims=True) / 2.0
    even = 1.0 / (values.shape[1] - 1)
    return np.asarray(np.divide(values, total, out=np.full_like(values, even), where=total > 0.0))


def _solid_angle(u: Array, theta_m: Array, dot: Array) -> Array:
    """Solid angle of view directions for a step in u and azimuth, up to a constant."""
    return np.maximum(dot, 0.0) * u * np.sin(theta_m)


def _steer(material: Material, theta_i: float, cosine: Array, phi: Array) -> Array:
    """Return f·cosθr averaged over a few bands, not negative."""
    values = projected(material, material.steering_bands, float(theta_i), cosine, phi)
    return np.asarray(np.maximum(values.mean(axis=-1), 0.0))


def _at(density: Array, x: Array, y: Array) -> Array:
    """Density at places x (B, A), y (B,), bilinear; never 0."""
    rows, columns = density.shape
    gy, gx = y * (rows - 1), x * (columns - 1)
    py = np.minimum(gy.astype(np.intp), rows - 2)
    px = np.minimum(gx.astype(np.intp), columns - 2)
    fy, fx, row = (gy - py)[:, None], gx - px, py[:, None]
    low = (1.0 - fx) * density[row, px] + fx * density[row, px + 1]
    high = (1.0 - fx) * density[row + 1, px] + fx * density[row + 1, px + 1]
    value = (1.0 - fy) * low + fy * high
    return np.asarray(np.maximum(value, 1e-6 * density.max()))


def _gains(material: Material, bands: Places, tables: Tables, warp: Warp) -> Array:
    """By what the values read between stored incident zeniths are to be multiplied, (SIGMA_NODES,).

    The weighted median of truth over value, which makes the sum of absolute errors the smallest.
    """
    reader = TensorReader(tables)
    shares = (np.arange(GAIN_SAMPLES) + 0.5) / GAIN_SAMPLES
    theta_i = tables.theta_i.astype(np.float64)
    grid = zenith_of(np.linspace(0.0, 1.0, SIGMA_NODES))
    inside = np.flatnonzero((grid > theta_i[0]) & (grid < theta_i[-1]))
    out = np.ones(SIGMA_NODES)
    for part in np.array_split(inside, max(1, len(inside) // GAIN_BLOCK)):
        views = []
        for incident in grid[part]:
            k = int(np.searchsorted(theta_i, incident)) - 1
            x, y = warp.place(k, shares, shares)
            _, cosine, phi = reflected(incident, zenith_of(x), azimuth_of(y)[:, None])
            seen = cosine > 0.05
            angles = np.full(seen.sum(), incident), np.arccos(cosine[seen]), phi[seen]
            views.append(np.rad2deg(np.stack(angles)))
        incidents, zeniths, azimuths = np.concatenate(views, axis=1)
        truth = material.brdf(incidents, zeniths, azimuths, bands).sum(axis=1)
        value = reader.brdf(incidents, zeniths, azimuths).sum(axis=1)
        ends = np.cumsum([view.shape[1] for view in views])[:-1]
        for j, t, v in zip(part, np.split(truth, ends), np.split(value, ends), strict=True):
            out[j] = _median_ratio(t, v)
    return out


def _median_ratio(truth: Array, value: Array) -> float:
    """Median of truth over value with values as weights; 1 where there are too few that are positive."""
    good = (truth > 0.0) & (value > 0.0)
    if good.sum() < GAIN_SAMPLES:
        return 1.0
    ratio, weight = truth[good] / value[good], value[good]
    order = np.argsort(ratio)
    heap = np.cumsum(weight[order])
    return float(ratio[order][np.searchsorted(heap, heap[-1] / 2.0)])

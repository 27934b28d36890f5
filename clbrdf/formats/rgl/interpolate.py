"""A measured BRDF between its directions.

For each incident zenith that was measured, ln f is interpolated linearly over half vectors, on triangles
in the plane (√θm cosφm, √θm sinφm), where a lobe is broad; outside of what was measured the nearest value
holds. Between incident zeniths ln f is interpolated linearly at the same half vector, so that a lobe moves
with the mirror direction; beyond the first and the last they hold. The surface is taken as isotropic.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.rgl.coordinates import half_vector, zenith_coordinate
from clbrdf.formats.rgl.material import Brdf, Places
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

SAME_ZENITH = 0.26
"""Degrees within which incident zeniths are taken as one: goniometers repeat them to a tenth or so."""

LEAST_BESIDE = 8
"""Directions out of the plane of incidence that an incident zenith needs."""

OUT_OF_PLANE = 5.0
"""Degrees between half vector and plane from which a direction counts as beside it, or a tenth of θm."""

SMALLEST = 1e-4
"""Values are raised to this part of the median of their band before the logarithm is taken."""


def interpolated(scan: Scan) -> tuple[Brdf, tuple[str, ...]]:
    """Return an isotropic BRDF through the values of a scan of reflection, and remarks.

    Raises
    ------
    InputError
        Fewer than two incident zeniths, or one that was measured in its plane of incidence only.
    """
    good = np.asarray(~scan.mask.any(axis=1))
    remarks = []
    if not good.all():
        remarks.append(f"{(~good).sum()} of {len(good)} directions with masked values are left out")
    groups = _groups(scan.theta_i[good])
    theta_i, theta_r = np.deg2rad(scan.theta_i[good]), np.deg2rad(scan.theta_r[good])
    theta_m, phi_m = half_vector(theta_i, theta_r, np.deg2rad(scan.phi[good]))
    values = _logarithms(scan.brdf[good])
    surfaces = {}
    beside = np.abs(np.sin(phi_m)) * np.rad2deg(theta_m) > np.minimum(OUT_OF_PLANE, np.rad2deg(theta_m) / 10)
    for zenith, rows in groups.items():
        if np.count_nonzero(beside[rows]) >= LEAST_BESIDE:
            surfaces[zenith] = _Surface(theta_m[rows], phi_m[rows], values[rows])
    if len(surfaces) < 2:
        if len(groups) >= 2:
            why = "was measured in the plane of incidence only"
        else:
            why = f"has {len(groups)} incident zenith{'s' if len(groups) != 1 else ''}"
        raise InputError(
            f"the scan {why} and cannot be interpolated over the hemisphere; fit a model (clbrdf fit) and"
            " take the fit"
        )
    if len(surfaces) < len(groups):
        count = len(groups) - len(surfaces)
        remarks.append(
            f"{count} of {len(groups)} incident zeniths, measured in their plane only, are left out"
        )
    if len(np.unique(scan.phi_i[good])) > 1:
        remarks.append("incident azimuths are averaged: the surface is taken as isotropic")
    zeniths = np.array(sorted(surfaces))
    ordered = [surfaces[z] for z in zeniths]

    def brdf(theta_i: Array, theta_r: Array, phi: Array, bands: Places) -> Array:
        theta_m, phi_m = half_vector(*(np.deg2rad(a) for a in (theta_i, theta_r, phi)))
        low = np.clip(np.searchsorted(zeniths, theta_i, side="right") - 1, 0, len(zeniths) - 2)
        weight = np.clip((theta_i - zeniths[low]) / (zeniths[low + 1] - zeniths[low]), 0.0, 1.0)
        out = np.zeros((len(theta_i), len(bands)))
        for k, surface in enumerate(ordered):
            share = np.where(low == k, 1.0 - weight, np.where(low + 1 == k, weight, 0.0))
            rows = share > 0.0
            if rows.any():
                out[rows] += share[rows, None] * surface(theta_m[rows], phi_m[rows])[:, bands]
        return np.exp(out)

    return brdf, tuple(remarks)


def _groups(theta_i: Array) -> dict[float, npt.NDArray[np.intp]]:
    """Rows of each incident zenith, by its mean."""
    order = np.argsort(theta_i, kind="stable")
    cuts = np.flatnonzero(np.diff(theta_i[order]) > SAME_ZENITH) + 1
    return {float(theta_i[rows].mean()): rows for rows in np.split(order, cuts) if len(rows)}


def _logarithms(values: Array) -> Array:
    positive = np.where(values > 0.0, values, np.nan)
    floor = SMALLEST * np.nanmedian(positive, axis=0)
    return np.asarray(np.log(np.maximum(values, floor)))


class _Surface:
    """ln f (N, W) over half vectors for one incident zenith, even in φ."""

    def __init__(self, theta_m: Array, phi_m: Array, values: Array) -> None:
        from scipy.interpolate import LinearNDInterpolator
        from scipy.spatial import cKDTree

        places = _plane(theta_m, phi_m)
        # Both sides of the plane of incidence look the same; what is measured on it stands once.
        both = np.concatenate([places, places * [1.0, -1.0]])
        spots, number = np.unique(np.round(both, 9), axis=0, return_inverse=True)
        number = number.ravel()
        count = np.bincount(number)
        total = np.zeros((len(spots), values.shape[1]))
        np.add.at(total, number, np.concatenate([values, values]))
        self._values = total / count[:, None]
        self._linear = LinearNDInterpolator(spots, self._values)
        self._tree = cKDTree(spots)

    def __call__(self, theta_m: Array, phi_m: Array) -> Array:
        places = _plane(theta_m, phi_m)
        out = np.asarray(self._linear(places))
        outside = np.isnan(out).any(axis=1)
        if outside.any():
            out[outside] = self._values[self._tree.query(places[outside])[1]]
        return out


def _plane(theta_m: Array, phi_m: Array) -> Array:
    radius = zenith_coordinate(theta_m)
    return np.stack([radius * np.cos(phi_m), radius * np.sin(phi_m)], axis=1)

"""What was stored: the directions of the nodes of an RGL file, and the BRDF there, without a search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.rgl.coordinates import azimuth_of, reflected, zenith_coordinate, zenith_of
from clbrdf.formats.rgl.tables import Tables
from clbrdf.formats.rgl.values import _filled, _plane
from clbrdf.formats.rgl.warp import Warp

Array = npt.NDArray[np.float64]

LARGEST_INCIDENT = np.deg2rad(89.9)
"""Beyond, files of the database repeat the last zenith that was measured."""

LOWEST_COSINE = 1e-3
"""Of the view zenith, 89.94°: below, f = value / cosθr says nothing."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """N stored directions and their values.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi_r : (N,) float64
        Degrees.
    brdf : (N, W) float64
        1/sr, without the cosine.
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array
    brdf: Array


def stored_nodes(tables: Tables) -> Nodes:
    """Return the nodes above the horizon.

    Left out are nodes below the horizon, incident zeniths of 90°, and the last row, whose azimuth is that
    of the first. The nodes of the mirror direction, one for each azimuth, are one and get their mean.
    """
    side = tables.spectra.shape[-1]
    shares = np.linspace(0.0, 1.0, side)
    vndf = tables.vndf
    warp = Warp.of(_filled(vndf.reshape(-1, *vndf.shape[2:])))
    parts = []
    for p, azimuth in enumerate(np.asarray(tables.phi_i, dtype=np.float64)):
        for k, zenith in enumerate(np.asarray(tables.theta_i, dtype=np.float64)):
            if zenith > LARGEST_INCIDENT:
                continue
            x, y = warp.place(p * len(tables.theta_i) + k, shares, shares[:-1])
            y = np.broadcast_to(y[:, None], x.shape)
            values = np.moveaxis(tables.spectra[p, k].astype(np.float64), 0, -1)[:-1]
            if tables.jacobian:
                facets = _plane(tables.ndf, x, y)
                incident = zenith_coordinate(np.array([zenith])), np.array([azimuth / (2 * np.pi) + 0.5])
                values = values * (facets / (4.0 * _plane(tables.sigma, *incident)))[..., None]
            values[:1, 0] = values[:, 0].mean(axis=0)
            phi_m = azimuth_of(y) - (0.0 if tables.isotropic else azimuth)
            _, cosine, phi = reflected(zenith, zenith_of(x), phi_m)
            kept = cosine > LOWEST_COSINE
            kept[1:, 0] = False
            angles = np.arccos(cosine[kept]), phi[kept] + azimuth
            parts.append(
                (
                    np.full(kept.sum(), zenith),
                    np.full(kept.sum(), azimuth),
                    *angles,
                    values[kept] / cosine[kept][:, None],
                )
            )
    theta_i, phi_i, theta_r, phi_r, brdf = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Nodes(np.rad2deg(theta_i), np.rad2deg(phi_i), np.rad2deg(theta_r), np.rad2deg(phi_r), brdf)

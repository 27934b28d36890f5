"""A file as the RGL database lays it out, made without the exporter: what its grid is worth.

Eight incident zeniths, 32 × 32 samples, 128 × 128 nodes of a density proportional to D(θm) (ωi·ωm)⁺
(Dupuy and Jakob 2018, doi:10.1145/3272127.3275059, section 4). Their D is found from retroreflection;
here it is the mean of the lobe over incident zeniths, as some models do not reflect back at all.
"""

from __future__ import annotations

import numpy as np

from clbrdf.formats.rgl.tables import Tables
from tests.formats.rgl.materials import WAVELENGTH

INCIDENTS, SIDE, NODES = 8, 32, 128


def inverse(cumulated, density, share):
    """Where the integral of a piecewise linear density reaches a share, in nodes."""
    k = np.clip(np.searchsorted(cumulated, share, side="right") - 1, 0, len(density) - 2)
    a, b, rest = density[k], density[k + 1], share - cumulated[k]
    root = np.sqrt(np.maximum(a * a + 2.0 * (b - a) * rest, 0.0))
    return k + np.divide(2.0 * rest, a + root, out=np.zeros_like(rest), where=a + root > 0.0)


def cumulate(density):
    return np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2.0)])


def view(theta_i, theta_m, phi_m):
    """Cosine between ωi and m, view zenith and azimuth, by vectors."""
    m = np.stack(
        np.broadcast_arrays(
            np.sin(theta_m) * np.cos(phi_m), np.sin(theta_m) * np.sin(phi_m), np.cos(theta_m)
        ),
        -1,
    )
    incident = np.array([np.sin(theta_i), 0.0, np.cos(theta_i)])
    dot = m @ incident
    out = 2.0 * dot[..., None] * m - incident
    return dot, np.arccos(np.clip(out[..., 2], -1, 1)), np.arctan2(out[..., 1], out[..., 0])


def database_tables(brdf):
    u = np.linspace(0.0, 1.0, NODES)
    theta_m, phi_m = u**2 * np.pi / 2.0, (2.0 * u - 1.0) * np.pi

    def projected(theta_i, theta_m, phi_m):
        dot, theta_r, phi = view(theta_i, theta_m, phi_m)
        seen = (dot > 0.0) & (theta_r < np.deg2rad(89.99))
        value = brdf(
            np.rad2deg(min(theta_i, np.deg2rad(89.5))),
            np.rad2deg(np.where(seen, theta_r, 0.5)),
            np.rad2deg(phi),
        )
        return np.where(seen, value * np.cos(theta_r), 0.0), dot, seen & (theta_r < np.deg2rad(87.0))

    D = np.zeros(NODES)
    for theta_i in np.deg2rad(np.arange(10.0, 71.0, 10.0)):
        value, _, valid = projected(theta_i, theta_m[:, None], phi_m[None, :-1])
        mean = np.where(valid, value, 0.0).sum(1) / np.maximum(valid.sum(1), 1)
        D = np.maximum(D, mean / mean.max())
    D = np.maximum(D, 1e-3)
    weight = 2.0 * np.pi * np.sin(theta_m) * np.pi * u / (NODES - 1)
    D /= (D * np.cos(theta_m) * weight).sum()
    sigma = np.array(
        [
            (D * weight * np.maximum(view(t, theta_m[:, None], phi_m[None, :-1])[0], 0.0).mean(1)).sum()
            for t in theta_m
        ]
    )

    theta_i = np.pi / 2.0 * np.linspace(0.0, 1.0, INCIDENTS) ** 0.8
    shares = np.clip(np.linspace(0.0, 1.0, SIDE), 2.0**-24, 1.0 - 2.0**-24)
    vndf, spectra = [], []
    for t in theta_i:
        density = D * np.maximum(view(t, theta_m[None, :], phi_m[:, None])[0], 0.0) * u * np.sin(theta_m)
        density /= density.sum()
        rows = np.array([cumulate(row) for row in density])
        below = cumulate(rows[:, -1])
        y = inverse(below, rows[:, -1], shares * below[-1])
        grid = np.empty((SIDE, SIDE))
        for n, at in enumerate(y):
            k = min(int(at), NODES - 2)
            line = (1.0 - at + k) * density[k] + (at - k) * density[k + 1]
            cumulated = cumulate(line)
            x = inverse(cumulated, line, shares * cumulated[-1]) / (NODES - 1)
            value = projected(t, x**2 * np.pi / 2.0, (2.0 * at / (NODES - 1) - 1.0) * np.pi)[0]
            grid[n] = value * 4.0 * np.interp(np.sqrt(2.0 * t / np.pi), u, sigma) / np.interp(x, u, D)
        vndf.append(density)
        spectra.append(grid)
    slope = WAVELENGTH / 550.0
    return Tables(
        description="made",
        phi_i=np.zeros(1),
        theta_i=np.minimum(theta_i, np.float32(np.pi / 2)),
        ndf=np.stack([D, D]),
        sigma=np.stack([sigma, sigma]),
        vndf=np.array(vndf)[None],
        luminance=np.maximum(np.array(spectra)[None], 1e-6),
        spectra=np.array(spectra)[None, :, None] * slope[:, None, None],
        wavelength=WAVELENGTH,
    )

"""Equations (8)-(14) in plain NumPy, as the paper prints them, and a multi-start fit with SciPy.

Shares nothing with the package: other formulas, other coordinates, numerical derivatives, another solver.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

TIN_FOIL = (3.87, 0.5216, -300.0, 0.74, 451.7958, 1.3034)
CERAMIC_TILE = (7.9678, 0.5555, -180.0, 0.74, 190.5, 1.8667)


def brdf(parameters, theta_i, theta_r, phi):
    """Return (8), 1/sr; angles in degrees."""
    a, b, c, d, ks, kd = parameters
    i, r, p = (np.deg2rad(np.asarray(angle, dtype=float)) for angle in (theta_i, theta_r, phi))
    cos_gamma = np.sqrt((np.cos(i) * np.cos(r) - np.sin(i) * np.sin(r) * np.cos(p) + 1) / 2)
    D = np.exp(c * np.maximum(1 - cos_gamma, 0.0) ** d)
    G2 = np.tan(i) ** 2 + np.tan(r) ** 2 - 2 * np.tan(i) * np.tan(r) * np.cos(p)
    F = np.exp(a * (b - np.cos(i)) ** 2)
    return ks * D * np.sqrt(np.maximum(G2, 0)) * F / (np.pi * np.cos(i) * np.cos(r)) + kd / np.pi


def objective(parameters, scan, k, weights=1.0):
    """Return (13) at the k-th wavelength of a scan, over its unmasked values."""
    good = ~scan.mask[:, k]
    f = scan.brdf[good, k]
    g = np.broadcast_to(weights, scan.brdf.shape[0])[good]
    model = brdf(parameters, scan.theta_i[good], scan.theta_r[good], scan.phi[good])
    return np.sum(g * (model - f) ** 2) / np.sum(g * f**2)


# a, b, log10(-c), d, log10 ks, kd: the default bounds of the model, with a floor for the logarithms
LOWER = np.array([-20.0, -1.0, -6.0, 0.2, -9.0, 0.0])
UPPER = np.array([20.0, 2.0, 6.0, 2.0, 5.0, 10.0])


def multi_start(scan, k, restarts=40, seed=0):
    """Return the lowest E that bounded least squares finds from random starts at the k-th wavelength."""
    rng = np.random.default_rng([seed, k])
    good = ~scan.mask[:, k]
    f = scan.brdf[good, k]
    angles = scan.theta_i[good], scan.theta_r[good], scan.phi[good]
    norm = np.sqrt(np.sum(f**2))

    def residuals(x):
        parameters = (x[0], x[1], -(10.0 ** x[2]), x[3], 10.0 ** x[4], x[5])
        return np.clip((brdf(parameters, *angles) - f) / norm, -1e100, 1e100)

    # Starts where a lobe can be seen; the solver itself moves within all of the bounds.
    low = np.array([-10.0, 0.0, 0.0, 0.3, np.log10(f.max()) - 4, 0.0])
    high = np.array([10.0, 1.0, 4.0, 1.5, np.log10(f.max()) + 1, min(10.0, np.pi * np.median(f) * 2)])
    best = np.inf
    for _ in range(restarts):
        start = low + (high - low) * rng.random(6)
        with np.errstate(all="ignore"):
            end = least_squares(
                residuals,
                np.clip(start, LOWER + 1e-9, UPPER - 1e-9),
                bounds=(LOWER, UPPER),
                x_scale="jac",
                max_nfev=200,
                xtol=1e-12,
                ftol=1e-12,
                gtol=1e-12,
            )
        best = min(best, 2.0 * end.cost)
    return best

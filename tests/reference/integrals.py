"""Quadrature over angles."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from tests.reference.models import REFERENCES

WAVELENGTH = 633.0


def nodes(breaks, count):
    """Gauss-Legendre nodes and weights over several intervals."""
    x, w = np.polynomial.legendre.leggauss(count)
    parts = [(low + (high - low) * (x + 1) / 2, (high - low) / 2 * w) for low, high in pairwise(breaks)]
    return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def reflectance(name, parameters, theta_i, theta_breaks, phi_breaks, count=20):
    """Directional-hemispherical reflectance of a model that is even in φ."""
    # A sum in 16 digits needs no more than 30 in its terms.
    reference = replace(REFERENCES[name], digits=30)
    thetas, theta_weights = nodes([0.0, *theta_breaks, 90.0], count)
    phis, phi_weights = nodes([0.0, *phi_breaks, 180.0], count)
    total = 0.0
    for theta, theta_weight in zip(thetas, theta_weights, strict=True):
        solid = np.sin(np.deg2rad(theta)) * np.cos(np.deg2rad(theta)) * theta_weight
        values = [float(reference.value(parameters, theta_i, 0.0, theta, phi, WAVELENGTH)) for phi in phis]
        total += solid * np.dot(values, phi_weights)
    return 2 * total * np.deg2rad(1.0) ** 2

"""Scenes and brute force that the tests of this folder share."""

from __future__ import annotations

import numpy as np

from clbrdf.scene import Scene
from tests.reference import naive


def scene(theta_i=60, theta_r=60, wavelength=550, phi_r=180, effects=None, surface=None, **more):
    """A scene of tin foil, one direction by default."""
    return Scene.model_validate(
        {
            "surface": surface or {},
            "directions": {
                "theta_i": theta_i,
                "theta_r": theta_r,
                "phi_r": phi_r,
                "region": "hemispherical",
            },
            "wavelength": wavelength,
            "effects": effects or {},
            **more,
        }
    )


def cone_grid(theta, phi, angle, panels, points=12):
    """Unit vectors (N, 3) and solid angles (N,) over a cone of a full angle, by panels about its own axis."""
    nodes, weights = np.polynomial.legendre.leggauss(points)

    def spread(low, high):
        edges = np.linspace(low, high, panels + 1)
        half = np.diff(edges)[:, None] / 2
        middle = (edges[:-1] + edges[1:])[:, None] / 2
        return (middle + half * nodes).ravel(), (half * weights).ravel()

    r, dr = spread(0.0, np.deg2rad(angle) / 2)
    s, ds = spread(0.0, 2 * np.pi)
    r, s = np.meshgrid(r, s, indexing="ij")
    t, p = np.deg2rad([theta, phi])
    axis = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    one = np.array([np.cos(t) * np.cos(p), np.cos(t) * np.sin(p), -np.sin(t)])
    two = np.array([-np.sin(p), np.cos(p), 0.0])
    rim = np.cos(s)[..., None] * one + np.sin(s)[..., None] * two
    vectors = np.cos(r)[..., None] * axis + np.sin(r)[..., None] * rim
    return vectors.reshape(-1, 3), (dr[:, None] * ds * np.sin(r)).ravel()


def angles_of(vectors):
    """Zeniths and azimuths of unit vectors, degrees."""
    x, y, z = vectors.T
    return np.rad2deg(np.arccos(z)), np.rad2deg(np.arctan2(y, x))


def brute_aperture(theta_i, theta_r, phi, angle, parameters=naive.TIN_FOIL, panels=40):
    """The mean over a detector's cone, in fp64, sharing nothing with the package."""
    vectors, solid = cone_grid(theta_r, phi, angle, panels)
    theta, azimuth = angles_of(vectors)
    f = naive.brdf(parameters, theta_i, theta, azimuth)
    return (solid * f * np.cos(np.deg2rad(theta))).sum() / (solid.sum() * np.cos(np.deg2rad(theta_r)))


def brute_beam(theta_i, theta_r, phi, angle, parameters=naive.TIN_FOIL, panels=40):
    """The mean over a source's cone."""
    vectors, solid = cone_grid(theta_i, 0.0, angle, panels)
    theta, azimuth = angles_of(vectors)
    return (solid * naive.brdf(parameters, theta, theta_r, phi - azimuth)).sum() / solid.sum()

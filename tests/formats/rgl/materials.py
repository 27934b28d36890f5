"""BRDFs in NumPy as their sources print them, to export; and Mitsuba's word on a file."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.formats.rgl.material import Material
from tests.reference import naive


def vectors(theta_i, theta_r, phi):
    i, r, p = (np.deg2rad(np.asarray(angle, dtype=float)) for angle in (theta_i, theta_r, phi))
    incident = np.stack(np.broadcast_arrays(np.sin(i), 0.0 * r, np.cos(i) + 0.0 * r), axis=-1)
    view = np.stack(np.broadcast_arrays(np.sin(r) * np.cos(p), np.sin(r) * np.sin(p), np.cos(r)), axis=-1)
    return incident, view


def ggx(alpha, F0):
    """Walter et al. 2007 with height-correlated Smith masking (Heitz 2014) and Schlick's Fresnel factor."""

    def brdf(theta_i, theta_r, phi):
        incident, view = vectors(theta_i, theta_r, phi)
        half = incident + view
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        ci, cr = incident[..., 2], view[..., 2]
        tan2 = (half[..., 0] ** 2 + half[..., 1] ** 2) / half[..., 2] ** 2
        D = 1.0 / (np.pi * alpha**2 * half[..., 2] ** 4 * (1.0 + tan2 / alpha**2) ** 2)
        smith = cr * np.sqrt(ci**2 + alpha**2 * (1 - ci**2)) + ci * np.sqrt(cr**2 + alpha**2 * (1 - cr**2))
        F = F0 + (1.0 - F0) * (1.0 - (incident * half).sum(axis=-1)) ** 5
        return D * F / (2.0 * smith)

    return brdf


def eon(rho, r):
    """Energy-preserving Oren-Nayar (Portsmouth, Kutz and Hill 2024, arXiv:2410.18026)."""
    c1, c2 = 0.5 - 2.0 / (3.0 * np.pi), 2.0 / 3.0 - 28.0 / (15.0 * np.pi)
    A = 1.0 / (1.0 + c1 * r)

    def spread(mu):
        s = np.sqrt(1.0 - mu**2)
        tan_term = 2.0 / 3.0 * (s * mu * (1.0 + s + s**2) / (1.0 + s) - s)
        return s * (np.arccos(mu) - s * mu) + tan_term

    def brdf(theta_i, theta_r, phi):
        incident, view = vectors(theta_i, theta_r, phi)
        ci, cr = incident[..., 2], view[..., 2]
        s = (incident * view).sum(axis=-1) - ci * cr
        single = rho / np.pi * A * (1.0 + r * s / np.where(s > 0.0, np.maximum(ci, cr), 1.0))
        mean = A * (1.0 + c2 * r)
        rest = rho**2 * mean / (1.0 - rho * (1.0 - mean))
        return single + rest / np.pi * A * r * (c1 - spread(ci) / np.pi) * (c1 - spread(cr) / np.pi) / (
            c1 - c2
        )

    return brdf


def lambert(rho):
    return lambda theta_i, theta_r, phi: rho / np.pi + 0.0 * (theta_i + theta_r + phi)


def total(*brdfs):
    return lambda *angles: sum(brdf(*angles) for brdf in brdfs)


MATERIALS = {
    "tin foil": lambda *angles: naive.brdf(naive.TIN_FOIL, *angles),
    "ggx 0.1 + lambert": total(ggx(0.1, 0.04), lambert(0.2)),
    "ggx 0.03 + lambert": total(ggx(0.03, 0.04), lambert(0.2)),
    "eon + ggx 0.3": total(eon(0.97, 0.6), ggx(0.3, 0.04)),
}

WAVELENGTH = np.array([450.0, 550.0, 650.0])


def spectral(brdf, wavelength=WAVELENGTH):
    """A material whose spectrum rises with the wavelength."""
    slope = wavelength / 550.0
    return Material(
        lambda i, r, p, bands: brdf(i, r, p)[:, None] * slope[bands], np.asarray(wavelength, float), "made"
    )


def coloured(brdf, colour=(0.9, 0.6, 0.3)):
    """A material in linear sRGB."""
    rgb = np.array(colour)
    return Material(lambda i, r, p, bands: brdf(i, r, p)[:, None] * rgb[bands], None, "made")


def mitsuba_brdf(path, theta_i, theta_r, phi, phi_i=0.0, wavelength=None):
    """Return the BRDF (N, W) that Mitsuba's own plugin reads off a file: RGB, or at wavelengths in nm.

    At θi = 0 its azimuth is that of (±0, ±0); a millionth of a radian settles it.
    """
    mi = pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    mi.set_variant("scalar_rgb" if wavelength is None else "scalar_spectral")
    plugin = mi.load_dict({"type": "measured", "filename": str(path)})
    context, at = mi.BSDFContext(), mi.SurfaceInteraction3f()
    angles = np.broadcast_arrays(theta_i, theta_r, phi, phi_i)
    groups = [None] if wavelength is None else [wavelength[k : k + 4] for k in range(0, len(wavelength), 4)]
    columns = []
    for group in groups:
        if group is not None:
            at.wavelengths = np.resize(group, 4)
        rows = []
        for i, r, p, turn in zip(*(np.deg2rad(a) for a in angles), strict=True):
            i = max(i, 1e-6)
            at.wi = [np.sin(i) * np.cos(turn), np.sin(i) * np.sin(turn), np.cos(i)]
            view = [np.sin(r) * np.cos(p + turn), np.sin(r) * np.sin(p + turn), np.cos(r)]
            rows.append(np.array(plugin.eval(context, at, view, True)) / np.cos(r))
        columns.append(np.array(rows)[:, : None if group is None else len(group)])
    return np.concatenate(columns, axis=1)

"""A made coating that is as hard to fit as real black coatings, and that no model of the package describes.

Two facet lobes of different widths and a rough base whose weights change with the wavelength, times a smooth
error of the instrument in angle and wavelength, plus noise and a floor of stray light. Formed here in NumPy
alone. In the plane of incidence at four wavelengths and few incident angles, with shaded directions masked
and three decades of values, as black coatings are measured. A clone alone holds fits to it; where the real
ones are (tests/conftest.py), they are held to those, too.

Of random starts of bounded least squares (wang2013, 40 starts a wavelength), the share that ends at the best,
and how many ends differ (a start that 400 evaluations do not end has missed):

    weights     real coatings, 11 wavelengths     this one, 4 wavelengths
    none        0.30 to 0.57, 2 to 4 ends         0.03 to 0.33, 2 to 4 ends
    relative    0.42 to 0.57, 3 to 6 ends         0.47 to 0.57, 4 ends
"""

from __future__ import annotations

import numpy as np

from clbrdf import Scan

MADE = "made_coating"
"""What tests call it beside the samples of real coatings."""

INCIDENT = (10.0, 30.0, 50.0, 70.0)
WAVELENGTH = np.array([400.0, 600.0, 850.0, 1060.0])
# By wavelength: slopes and Fresnel reflectances of the two lobes, albedo and roughness of the base.
NARROW = ((0.11, 0.0030), (0.13, 0.0012), (0.07, 0.0035), (0.16, 0.0028))
WIDE = ((0.42, 0.020), (0.35, 0.008), (0.50, 0.012), (0.45, 0.020))
BASE = ((0.006, 0.6), (0.004, 0.9), (0.004, 0.3), (0.008, 0.8))
STRUCTURE, NOISE, FLOOR = 0.15, 0.01, 2e-4


def _facets(mu_i, mu_r, mu_h, mu_d, alpha, f0):
    """GGX facets, height-correlated shadowing, Schlick's reflectance (Walter et al. 2007, Heitz 2014)."""
    spread = alpha**2 / (np.pi * (1.0 + (alpha**2 - 1.0) * mu_h**2) ** 2)
    i, r = (np.sqrt(alpha**2 + (1.0 - alpha**2) * mu**2) for mu in (mu_i, mu_r))
    return (f0 + (1.0 - f0) * (1.0 - mu_d) ** 5) * spread / (2.0 * (mu_r * i + mu_i * r))


def _base(mu_i, mu_r, cos_phi, albedo, roughness):
    """Fujii's improved Oren–Nayar base, without multiple scattering (as EON's single term)."""
    s = cos_phi * np.sqrt((1.0 - mu_i**2) * (1.0 - mu_r**2))
    s = np.where(s > 0.0, s / np.maximum(mu_i, mu_r), s)
    return albedo / np.pi * (1.0 + roughness * s) / (1.0 + (0.5 - 2.0 / (3.0 * np.pi)) * roughness)


def made_coating(seed: int = 17) -> Scan:
    """Return the scan: 114 directions, of which the nearest to the source are masked, at 4 wavelengths."""
    signed = np.linspace(-75.0, 75.0, 28)
    theta_i = np.concatenate([np.repeat(INCIDENT, len(signed)), [0.0, 0.0]])
    signed = np.concatenate([np.tile(signed, len(INCIDENT)), [45.0, -45.0]])
    rng, columns = np.random.default_rng(seed), []
    side = np.where(signed < 0.0, -1.0, 1.0)
    mu_i, mu_r = np.cos(np.deg2rad(theta_i)), np.cos(np.deg2rad(signed))
    half, turn = np.deg2rad((signed - theta_i) / 2.0), np.deg2rad((signed + theta_i) / 2.0)
    for k, nm in enumerate(WAVELENGTH):
        f = _base(mu_i, mu_r, -side, *BASE[k])
        for alpha, f0 in (NARROW[k], WIDE[k]):
            f = f + _facets(mu_i, mu_r, np.cos(half), np.cos(turn), alpha, f0)
        wave = np.sin(np.deg2rad(5.0 * signed) + nm / 150.0) * np.cos(np.deg2rad(3.0 * theta_i) - nm / 400.0)
        columns.append((f * (1.0 + STRUCTURE * wave) + FLOOR) * (1.0 + NOISE * rng.standard_normal(len(f))))
    brdf = np.stack(columns, axis=1)
    shaded = np.abs(signed + theta_i) < 4.0
    flags = np.where(shaded, 1, 0).astype(np.uint32)[:, None] * np.ones(len(WAVELENGTH), np.uint32)
    phi = np.where(signed < 0.0, 0.0, 180.0)
    return Scan(
        theta_i,
        np.zeros(1),
        np.abs(signed),
        phi,
        WAVELENGTH,
        brdf,
        sigma=0.02 * brdf,
        flags=flags,
        sample="made coating (SYNTHETIC)",
    )

"""Rayleigh-Rice perturbation with a K-correlated power spectral density; A in µm⁴, B in µm, wavelength in nm.

Stover, Optical Scattering; Germer, SCATMECH, Microroughness_BRDF_Model.
"""

from __future__ import annotations

from mpmath import mpc, mpf, pi, sqrt

from tests.reference.models.reference import Reference


def polarisation_factors(g, n: mpf, k: mpf) -> tuple[mpf, mpf, mpf, mpf]:
    """Give the squared moduli for s to s, p to s, s to p and p to p.

    The azimuth φs out of the plane of incidence is 0 in the specular half-plane: its cosine is −cos φ.
    """
    epsilon = mpc(n, k) ** 2
    cos_s, sin_s = -g.cos_phi, g.sin_phi
    R_i, R_r = (sqrt(epsilon - sine**2) for sine in (g.sin_i, g.sin_r))
    s_i, s_r = g.cos_i + R_i, g.cos_r + R_r
    p_i, p_r = epsilon * g.cos_i + R_i, epsilon * g.cos_r + R_r
    ss = cos_s / (s_i * s_r)
    ps = -R_i * sin_s / (p_i * s_r)
    sp = -R_r * sin_s / (s_i * p_r)
    pp = (epsilon * g.sin_i * g.sin_r - R_i * R_r * cos_s) / (p_i * p_r)
    ss, ps, sp, pp = (abs((epsilon - 1) * q) ** 2 for q in (ss, ps, sp, pp))
    return ss, ps, sp, pp


def _rayleigh_rice(g, p, wavelength):
    micrometres = wavelength / 1000
    frequency = g.beta / micrometres
    psd = p["A"] / (1 + (p["B"] * frequency) ** 2) ** (p["C"] / 2)
    Q = sum(polarisation_factors(g, p["n"], p["k"])) / 2
    return 16 * pi**2 / micrometres**4 * g.cos_i * g.cos_r * Q * psd


RAYLEIGH_RICE = Reference(
    ("A", "B", "C", "n", "k"), _rayleigh_rice, edges={"k": (0, None)}, needs_wavelength=True
)

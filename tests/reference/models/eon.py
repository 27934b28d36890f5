"""EON: Fujii's variant of Oren and Nayar's model, and a second lobe that returns the energy it loses.

Portsmouth, Kutz and Hill, arXiv:2410.18026.
"""

from __future__ import annotations

from mpmath import cos, mpf, pi, sin, tan

from tests.reference.models.geometry import dot
from tests.reference.models.reference import Reference


def flat(r: mpf) -> mpf:
    """A_F of the paper: what is left of the lobe where its angular term is 0."""
    return 1 / (1 + (mpf(1) / 2 - 2 / (3 * pi)) * r)


def fujii(g, rho: mpf, r: mpf) -> mpf:
    """Give the single-scattering lobe, with s from the dot product of the directions."""
    s = dot(g.incident, g.reflected) - g.cos_i * g.cos_r
    t = max(g.cos_i, g.cos_r) if s > 0 else mpf(1)
    return rho / pi * flat(r) * (1 + r * s / t)


def directional_albedo(theta: mpf, r: mpf) -> mpf:
    """Give the share of light from zenith angle theta that the first lobe reflects where rho is 1."""
    S = sin(theta)
    G = S * (theta - S * cos(theta)) + mpf(2) / 3 * (tan(theta) * (1 - S**3) - S)
    return flat(r) * (1 + r * G / pi)


def average_albedo(r: mpf) -> mpf:
    """Give the cosine-weighted mean of the directional albedo over the hemisphere."""
    return flat(r) * (1 + (mpf(2) / 3 - 28 / (15 * pi)) * r)


def _eon(g, p, wavelength):
    rho, r = p["rho"], p["r"]
    single = fujii(g, rho, r)
    if r == 0:
        return single  # nothing is lost; the printed form of the rest is 0/0
    mean = average_albedo(r)
    lost_i, lost_r = (1 - directional_albedo(theta, r) for theta in (g.theta_i, g.theta_r))
    rho_ms = rho**2 * mean / (1 - rho * (1 - mean))
    return single + rho_ms / pi * lost_i * lost_r / (1 - mean)


EON = Reference(("rho", "r"), _eon, edges={"r": (0, None)})

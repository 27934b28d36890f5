"""Rahman, Pinty and Verstraete, doi:10.1029/93JD02072; printed as a reflectance factor, π times the BRDF."""

from __future__ import annotations

from mpmath import cos, mpf, pi

from tests.reference.models.reference import Reference


def _rpv(g, p, wavelength):
    k, Theta = p["k"], p["Theta"]
    minnaert = g.cos_i ** (k - 1) * g.cos_r ** (k - 1) / (g.cos_i + g.cos_r) ** (1 - k)
    phase = (1 - Theta**2) / (1 + Theta**2 - 2 * Theta * cos(pi - g.phase)) ** mpf("1.5")
    hot_spot = 1 + (1 - p["rho_c"]) / (1 + g.distance)
    return p["rho0"] * minnaert * phase * hot_spot / pi


RPV = Reference(("rho0", "k", "Theta", "rho_c"), _rpv)

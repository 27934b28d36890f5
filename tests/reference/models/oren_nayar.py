"""The qualitative model of Oren and Nayar, doi:10.1145/192161.192213; sigma in radians."""

from __future__ import annotations

from mpmath import mpf, pi, sin, tan

from tests.reference.models.reference import Reference


def _oren_nayar(g, p, wavelength):
    rho, sigma2 = p["rho"], p["sigma"] ** 2
    a = 1 - mpf("0.5") * sigma2 / (sigma2 + mpf("0.33"))
    b = mpf("0.45") * sigma2 / (sigma2 + mpf("0.09"))
    alpha, beta = max(g.theta_i, g.theta_r), min(g.theta_i, g.theta_r)
    return rho / pi * (a + b * max(mpf(0), g.cos_phi) * sin(alpha) * tan(beta))


OREN_NAYAR = Reference(("rho", "sigma"), _oren_nayar)

"""Minnaert, ApJ 93 (1941) 403, normalised so that rho is the reflectance at normal incidence."""

from __future__ import annotations

from mpmath import pi

from tests.reference.models.reference import Reference


def _minnaert(g, p, wavelength):
    rho, k = p["rho"], p["k"]
    return rho * (k + 1) / (2 * pi) * (g.cos_i * g.cos_r) ** (k - 1)


MINNAERT = Reference(("rho", "k"), _minnaert)

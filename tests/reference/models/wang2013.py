"""Equation (8) of Wang, Zhang and Dong, from tests/reference/exact.py."""

from __future__ import annotations

from tests.reference import exact
from tests.reference.models.reference import Reference


def _wang2013(g, p, wavelength):
    theta_i, phi_i, theta_r, phi_r = g.degrees
    values = [p[name] for name in ("a", "b", "c", "d", "ks", "kd")]
    return exact.brdf(values, theta_i, theta_r, phi_r - phi_i)


# In the mirror direction (1 − cosγ)^d is 0; rounding of 1e-400 makes it 1e-80 for the smallest d, 0.2.
WANG2013 = Reference(("a", "b", "c", "d", "ks", "kd"), _wang2013, digits=400)

"""Ross-Thick Li-Sparse-Reciprocal: Wanner et al. 1995, Lucht et al. 2000 (doi:10.1109/36.841980).

Printed as a reflectance factor, π times the BRDF. Crowns are MODIS's: h/b = 2, b/r = 1, which is a sphere.
"""

from __future__ import annotations

from mpmath import acos, cos, mpf, pi, sin, sqrt, tan

from tests.reference.models.reference import Reference


def ross_thick(g) -> mpf:
    return ((pi / 2 - g.phase) * cos(g.phase) + sin(g.phase)) / (g.cos_i + g.cos_r) - pi / 4


def li_sparse_reciprocal(g) -> mpf:
    sec_i, sec_r = 1 / g.cos_i, 1 / g.cos_r
    across = tan(g.theta_i) * tan(g.theta_r) * g.sin_phi
    t = acos(min(2 * sqrt(g.distance**2 + across**2) / (sec_i + sec_r), mpf(1)))
    overlap = (t - sin(t) * cos(t)) * (sec_i + sec_r) / pi
    return overlap - sec_i - sec_r + (1 + cos(g.phase)) * sec_i * sec_r / 2


def _ross_li(g, p, wavelength):
    return (p["f_iso"] + p["f_vol"] * ross_thick(g) + p["f_geo"] * li_sparse_reciprocal(g)) / pi


ROSS_LI = Reference(("f_iso", "f_vol", "f_geo"), _ross_li)

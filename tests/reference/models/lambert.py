"""The perfect diffuser: Nicodemus et al., NBS Monograph 160 (1977)."""

from __future__ import annotations

from mpmath import pi

from tests.reference.models.reference import Reference


def _lambert(g, p, wavelength):
    return p["rho"] / pi


LAMBERT = Reference(("rho",), _lambert)

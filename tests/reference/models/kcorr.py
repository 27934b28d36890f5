"""K-correlation scatter: Church and Takacs, Proc. SPIE 1165 (1989); Dittman, Proc. SPIE 6291 (2006)."""

from __future__ import annotations

from tests.reference.models.reference import Reference


def _kcorr(g, p, wavelength):
    return p["b0"] / (1 + (g.beta / p["l"]) ** 2) ** (p["C"] / 2)


KCORR = Reference(("b0", "l", "C"), _kcorr)

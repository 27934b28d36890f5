"""ABg scatter, A/(B + |β − β0|^g), of the Harvey-Shack family; b0 = A/B and x_k = B^(1/g)."""

from __future__ import annotations

from tests.reference.models.reference import Reference


def _abg(g, p, wavelength):
    B = p["x_k"] ** p["g"]
    A = p["b0"] * B
    return A / (B + g.beta ** p["g"])


ABG = Reference(("b0", "x_k", "g"), _abg)

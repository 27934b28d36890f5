"""The spectrometer's slit passes a band of wavelengths.

    f(λ) = ∫ s(δ) f(λ + δ) dδ,     ∫ s dδ = 1

with a slit function s of full width w at half height: "triangle" (entrance and exit slit alike),
    s = (1 − |δ| / w) / w for |δ| < w;  "rectangle", s = 1 / w for |δ| < w / 2;  "gauss", cut at 5 σ.

The lamp's spectrum is taken as flat within the slit. Source of the triangle: convolution of two equal
slits. Default width: the spectral resolution of 2.4 nm of Wang, Zhang and Dong (2013). Gauss-Legendre on
both halves.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

SIGMAS = 5.0
"""Where the Gaussian is cut; what is beyond holds 6e-7 of it."""


class Bandwidth(TomlTable):
    """Settings.

    Attributes
    ----------
    width : float
        Full width at half height, nm.
    shape : "triangle", "rectangle" or "gauss"
    """

    width: Annotated[float, Field(gt=0.0, le=100.0)] = 2.4
    shape: Literal["triangle", "rectangle", "gauss"] = "triangle"


def slit_nodes(settings: Bandwidth, order: int) -> tuple[Array, Array]:
    """Return offsets (B,) in nm and shares (B,) that add up to 1; B = 2 order, or 1 for order 0."""
    if order == 0:
        return np.zeros(1), np.ones(1)
    s, weight = np.polynomial.legendre.leggauss(order)
    s, weight = (s + 1.0) / 2.0, weight / 2.0
    sigma = settings.width / np.sqrt(8.0 * np.log(2.0))
    reach = {"triangle": settings.width, "rectangle": settings.width / 2.0, "gauss": SIGMAS * sigma}
    offsets = reach[settings.shape] * s
    if settings.shape == "triangle":
        weight = weight * (1.0 - s)
    elif settings.shape == "gauss":
        weight = weight * np.exp(-((offsets / sigma) ** 2) / 2.0)
    shares = weight / (2.0 * weight.sum())
    return np.concatenate([-offsets[::-1], offsets]), np.concatenate([shares[::-1], shares])

"""The detector shows x counts where a linear one shows net: x / p(x / full scale) = net.

p is the polynomial by which a linearity correction would divide, lowest power first. Source: the correction
of array spectrometers, here left undone; equation (6) of Wang, Zhang and Dong (2013) gives nonlinearity 0.4
%, by default reached at full scale: p(u) = 1 + 0.004 u.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

ITERATIONS = 60
"""Of x ← net p(x): p is near 1, and each takes off two digits or more."""


class Nonlinearity(TomlTable):
    """Settings.

    Attributes
    ----------
    polynomial : tuple of float
        p over counts as a share of full scale, lowest power first; between 0.5 and 2 from 0 to full scale.
    """

    polynomial: Annotated[tuple[float, ...], Field(min_length=1, max_length=12)] = (1.0, 0.004)

    @model_validator(mode="after")
    def _check(self) -> Nonlinearity:
        p = np.polynomial.polynomial.polyval(np.linspace(0.0, 1.0, 101), self.polynomial)
        if p.min() < 0.5 or p.max() > 2.0:
            raise ValueError(f"polynomial runs from {p.min():g} to {p.max():g}; keep it between 0.5 and 2")
        return self


def in_counts(polynomial: Sequence[float], full_scale: float) -> tuple[float, ...]:
    """Return the coefficients for counts, of those for shares of full scale."""
    return tuple(value / full_scale**k for k, value in enumerate(polynomial))


def shown_counts(net: Array, coefficients: Sequence[float], full_scale: float) -> Array:
    """Return counts x with x / p(x) = net, p over counts, by fixed-point iteration."""
    shown = net.copy()
    for _ in range(ITERATIONS):
        shown = net * np.polynomial.polynomial.polyval(np.clip(shown, 0.0, full_scale), coefficients)
    return shown

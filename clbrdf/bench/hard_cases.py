"""Cases where the arithmetic is hardest, named, for every precision to run against 60 digits.

Each case is a family of directions and parameter sets of the default model, all combinations of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import numpy.typing as npt

from clbrdf.models import get_model

Array = npt.NDArray[np.float64]

TIN_FOIL = {p.name: p.default for p in get_model().parameters}
"""The model's defaults, Table 1 of the paper; cases change what they name."""

GAMMAS = (0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
ZENITHS = (0.0, 1e-6, 30.0, 85.0, 89.9, 89.999999)


@dataclass(frozen=True)
class HardCase:
    """A family of hard evaluations.

    Attributes
    ----------
    name, why : str
        What it is, and what goes wrong there with careless arithmetic.
    directions : tuple of (θi, θr, φ)
        Degrees.
    changes : mapping of str to tuple of float
        Values that parameters take in turn; the others are those of the tin foil.
    """

    name: str
    why: str
    directions: tuple[tuple[float, float, float], ...]
    changes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def parameter_sets(self) -> Iterator[dict[str, float]]:
        """Yield each parameter set of the family."""
        for values in product(*self.changes.values()):
            yield {**TIN_FOIL, **dict(zip(self.changes, values, strict=True))}

    def angles(self) -> tuple[Array, Array, Array]:
        """Return θi, θr, φ, each (N,), degrees."""
        theta_i, theta_r, phi = np.array(self.directions).T
        return theta_i, theta_r, phi


def _near_mirror() -> tuple[tuple[float, float, float], ...]:
    """Directions at half-angles γ from the mirror direction, in zenith and in azimuth."""
    out = []
    for theta in (1.0, 30.0, 60.0, 85.0):
        for gamma in GAMMAS:
            step = float(np.degrees(2.0 * gamma))
            out += [(theta, theta + step, 180.0), (theta, theta, 180.0 - step)]
    return tuple(out)


def _corners() -> tuple[tuple[float, float, float], ...]:
    azimuths = (0.0, 1e-6, 90.0, 179.999999, 180.0)
    return tuple((i, r, phi) for i in ZENITHS for r in ZENITHS for phi in azimuths)


PLAIN = tuple((i, r, 180.0) for i in (0.0, 30.0, 60.0) for r in (0.0, 10.0, 29.0, 30.0, 45.0, 60.0, 80.0))

HARD_CASES = (
    HardCase(
        "specular peak",
        "γ = 0 and 1e-8 to 1e-3 rad: 1 − cosγ formed by subtraction has no digits left",
        _near_mirror(),
        {"d": (0.2, 0.74, 2.0), "c": (-300.0, -1e6)},
    ),
    HardCase("grazing", "zeniths to 89.999999°: 1/cosθ shows every error of π/2 − θ", _corners()),
    HardCase(
        "retro direction",
        "θr = θi, φ = 0: G is the root of a difference of squares",
        tuple((t, t + s, p) for t in (0.0, 30.0, 85.0) for s in (0.0, 1e-7, 1e-3) for p in (0.0, 1e-6)),
        {"kd": (0.0, 1.3034)},
    ),
    HardCase(
        "lobe shape at its limits",
        "c = 0 is no lobe, c = −1e6 a needle; d = 0.2 a cusp, d = 2 a plateau",
        PLAIN,
        {"c": (0.0, -1e-6, -1.0, -1e6), "d": (0.2, 2.0), "kd": (0.0, 1.3034)},
    ),
    HardCase(
        "Fresnel factor at its limits",
        "F from e^-180 to e^180 leaves the range of single precision on both sides",
        PLAIN,
        {"a": (-20.0, 20.0), "b": (-1.0, 0.5, 2.0), "kd": (0.0, 1.3034)},
    ),
    HardCase(
        "cancelling exponents",
        "F and D leave the range, their product does not: only the sum of logarithms is finite",
        PLAIN,
        {"a": (20.0,), "b": (2.0,), "c": (-90.0, -400.0), "d": (0.2, 1.0), "kd": (0.0, 10.0)},
    ),
    HardCase(
        "nothing specular, nothing diffuse",
        "ks = 0 or kd = 0: logarithms of zero, and products of zero with infinity",
        PLAIN,
        {"ks": (0.0, 1e-300, 1e5), "kd": (0.0, 10.0)},
    ),
    HardCase(
        "twelve decades",
        "peak and wings of one lobe differ by 12 decades and more",
        tuple((60.0, r, 180.0) for r in np.arange(0.0, 86.0, 2.5)),
        {"kd": (0.0, 1e-9), "ks": (1e-6, 1e5)},
    ),
)

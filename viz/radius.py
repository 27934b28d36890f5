"""How a BRDF value becomes a length: one scale for everything in a picture, named on it.

linear   r = f / top
cosine   r = f cosθr / top, the radiant intensity's shape
log      r = log(f / floor) / log(top / floor), 0 below the floor
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
RadiusMode = Literal["linear", "log", "cosine"]

RADIUS_MODES: tuple[RadiusMode, ...] = ("linear", "log", "cosine")
DECADES = 4.0
"""Span of a logarithmic radius of modelled values, where these do not end earlier."""


@dataclass(frozen=True)
class RadiusScale:
    """From values in 1/sr to lengths; the value `top` has length 1.

    Attributes
    ----------
    mode : "linear", "log" or "cosine"
    top : float
        1/sr, positive.
    floor : float
        For "log": the value of length 0, 1/sr, positive and below `top`.
    """

    mode: RadiusMode
    top: float
    floor: float

    def length(self, values: npt.ArrayLike, cos_r: npt.ArrayLike) -> npt.NDArray[np.floating]:
        """Lengths of BRDF values (1/sr) at cosines of the view zenith; shapes and types as given.

        Values that are not finite end at the top; the picture says how many there are.
        """
        f = np.asarray(values)
        if not np.isfinite(f).all():
            f = np.nan_to_num(f, nan=0.0, posinf=self.top, neginf=0.0)
        if self.mode == "linear":
            return np.asarray(f * f.dtype.type(1.0 / self.top))
        if self.mode == "cosine":
            return np.asarray(f * np.asarray(cos_r, dtype=f.dtype) * f.dtype.type(1.0 / self.top))
        span = np.log(self.top / self.floor)
        lowest = f.dtype.type(self.floor)
        return np.asarray(np.log(np.maximum(f, lowest) / lowest) * f.dtype.type(1.0 / span))

    def signed_length(self, differences: npt.ArrayLike, cos_r: npt.ArrayLike) -> npt.NDArray[np.floating]:
        """Lengths of the magnitudes of differences."""
        return self.length(np.abs(np.asarray(differences)), cos_r)

    def ticks(self) -> list[tuple[float, str]]:
        """Lengths and labels of the scale bar, from 0 to 1, three to six of them."""
        if self.mode == "log":
            first, last = np.ceil(np.log10(self.floor) - 1e-9), np.floor(np.log10(self.top) + 1e-9)
            stride = max(1.0, np.ceil((last - first) / 5.0))
            values = [10.0**k for k in np.arange(first, last + 1.0, stride)]
            if len(values) < 3:
                values = fine_steps(self.floor, self.top)
            return [(float(self.length(v, 1.0)), tick_text(v)) for v in values]
        step = nice_step(self.top)
        return [
            (k * step / self.top, tick_text(k * step)) for k in range(int(self.top / step * (1.0 + 1e-9)) + 1)
        ]

    @property
    def title(self) -> str:
        """What the radius means, for the picture."""
        return {
            "linear": "radius: BRDF, linear",
            "cosine": "radius: BRDF × cos θr, linear",
            "log": f"radius: BRDF, logarithmic from {self.floor:.3g} 1/sr",
        }[self.mode]

    @property
    def quantity(self) -> str:
        """Name and unit of the scale bar."""
        return "BRDF × cos θr (1/sr)" if self.mode == "cosine" else "BRDF (1/sr)"


def tick_text(value: float) -> str:
    """Return a tick's value without an exponent where it reads well."""
    text = f"{float(f'{value:.4g}'):g}" if abs(value) < 1e5 else f"{value:.4g}"
    return text.replace("e+0", "e").replace("e-0", "e-")


def steps_125(low: float, high: float) -> list[float]:
    """Return the values 1, 2 and 5 times powers of ten in [low, high], both positive; the ends if few."""
    powers = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    values = [m * 10.0**k for k in powers for m in (1.0, 2.0, 5.0)]
    inside = [v for v in values if low * (1 - 1e-9) <= v <= high * (1 + 1e-9)]
    return inside if len(inside) >= 2 else [low, high]


def fine_steps(low: float, high: float) -> list[float]:
    """Values for a logarithmic axis without decades in it: 1, 2, 5, or even steps where those are few."""
    values = steps_125(low, high)
    if len(values) >= 3:
        return values
    step = nice_step(high - low)
    return [float(k * step) for k in np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)]


def nice_step(top: float) -> float:
    """Step of 1, 2 or 5 times a power of ten that divides [0, top] into three to six parts."""
    power = 10.0 ** np.floor(np.log10(top / 3.0))
    return float(max(step for step in (power, 2.0 * power, 5.0 * power) if step * 3.0 <= top * (1 + 1e-9)))


def make_scale(
    mode: RadiusMode,
    values: npt.ArrayLike,
    cos_r: npt.ArrayLike,
    floor: float | None = None,
    decades: float = DECADES,
) -> RadiusScale:
    """Return the scale that fits values (1/sr): the longest has length 1.

    Parameters
    ----------
    mode : "linear", "log" or "cosine"
    values, cos_r : arrays of one shape
        Everything that will be drawn with this scale.
    floor : float, optional
        For "log"; else the smallest value, rounded down to a power of ten, at most `decades` below the top.
    decades : float

    Raises
    ------
    InputError
        Unknown mode, or a floor that is not positive or not below the largest value.
    """
    if mode not in RADIUS_MODES:
        raise InputError(f"no radius is called {mode!r}; there are {', '.join(RADIUS_MODES)}")
    f, cosine = np.broadcast_arrays(np.asarray(values, float), np.asarray(cos_r, float))
    good = np.isfinite(f) & (f > 0.0)
    if not good.any():
        return RadiusScale(mode, 1.0, floor if floor is not None and 0.0 < floor < 1.0 else 1e-3)
    top = float((f * cosine)[good].max() if mode == "cosine" else f[good].max())
    if floor is None:
        lowest = max(float(f[good].min()), top * 10.0**-decades)
        # The floor lies under the smallest value by at least a fifth of a decade, so that it is seen.
        floor = float(10.0 ** np.floor(np.log10(lowest) - 0.2))
    if not 0.0 < floor < top:
        raise InputError(
            f"the floor of the logarithmic radius is {floor:g} 1/sr; give a value between 0 and {top:.4g}"
        )
    return RadiusScale(mode, top, floor)


def common_scale(scales: list[RadiusScale]) -> RadiusScale:
    """Return one scale for all of several: the largest top and the smallest floor."""
    return replace(scales[0], top=max(s.top for s in scales), floor=min(s.floor for s in scales))

"""What a reader hands over: numbers as they stand in a file, and what the file says they mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import ANGLES
from clbrdf.scan.flags import FLAGS

Array = npt.NDArray[np.float64]

SCALES: Mapping[str, float] = MappingProxyType(
    {"1": 1.0, "pi": 1.0 / np.pi, "percent": 0.01, "pi-percent": 0.01 / np.pi}
)
"""What a value is multiplied by to be in 1/sr: it is f, π f, 100 f or 100 π f."""


@dataclass(frozen=True)
class Stated:
    """What a file, or its format, says that its numbers mean; None where it is left open.

    Attributes
    ----------
    angle : "deg" or "rad"
    length : "nm" or "um"
    origin : "normal" or "specular"
        Where view zeniths are counted from.
    forward : 0, 180 or None
        Difference φr − φi of the half-plane that holds the mirror direction, degrees.
    cosine : bool or None
        Whether values are multiplied by cosθr.
    scale : key of SCALES, or None
    sure : frozenset of str
        Names of these that the specification of the format settles, so that data cannot overrule them.
    """

    angle: str | None = "deg"
    length: str | None = "nm"
    origin: str = "normal"
    forward: float | None = 180.0
    cosine: bool | None = False
    scale: str | None = "1"
    sure: frozenset[str] = frozenset()


CONVENTIONS = ("angle", "length", "origin", "forward", "cosine", "scale")
SURE = frozenset(CONVENTIONS)
"""For formats whose specification leaves nothing open."""


@dataclass(frozen=True, eq=False)
class Reading:
    """One sample as its file has it; M rows in any order, or the N × W rectangle already.

    Attributes
    ----------
    theta_i, phi_i, theta_r, phi_r : (N,) float64
        As in the file, in its unit.
    values : (N, W) float64
        As in the file.
    spectrum : (W,) float64
        Wavelengths in the file's unit; empty where there are `bands`.
    bands : tuple of str
    stated : Stated
    sigma : (N, W) float64 or None
        In the unit of `values`.
    common : (N, W) float64 or None
        Standard uncertainty that all values have in common, in their unit; `sigma` is that of the rest then.
    flags : (N, W) uint32 or None
    flag_names : tuple of str
    sample, instrument : str
    notes : tuple of str
        What the reader left out or took for granted, a line each.
    extra : mapping
        Further arguments of the scan: polarisations, solid_angle, bandpass.
    lines : (N,) float64 or None
        Line of the file that each direction comes from, for messages.
    tis : mapping of float to float
        Total integrated scatter that the file states, by incident zenith in degrees.
    provenance : mapping of str to str
        What the file says of itself.
    """

    theta_i: Array
    phi_i: Array
    theta_r: Array
    phi_r: Array
    values: Array
    spectrum: Array = field(default_factory=lambda: np.empty(0))
    bands: tuple[str, ...] = ()
    stated: Stated = Stated(sure=SURE)
    sigma: Array | None = None
    flags: npt.NDArray[np.uint32] | None = None
    flag_names: tuple[str, ...] = FLAGS
    sample: str = ""
    instrument: str = ""
    notes: tuple[str, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict)
    lines: Array | None = None
    tis: Mapping[float, float] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    common: Array | None = None

    def rows(self, index: Any) -> Reading:
        """Return the reading in some of its directions."""
        angle = self.extra.get("solid_angle")
        extra = dict(self.extra)
        if angle is not None and np.ndim(angle):
            extra["solid_angle"] = np.asarray(angle)[index]
        return replace(
            self,
            **{name: getattr(self, name)[index] for name in ANGLES},
            values=self.values[index],
            sigma=None if self.sigma is None else self.sigma[index],
            common=None if self.common is None else self.common[index],
            flags=None if self.flags is None else self.flags[index],
            lines=None if self.lines is None else self.lines[index],
            extra=extra,
        )

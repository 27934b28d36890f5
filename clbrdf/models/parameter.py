"""One row of a model's parameter table."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """One row of a model's parameter table.

    Attributes
    ----------
    name, unit, meaning : str
        As in the source; the unit is "1" for a pure number.
    default : float
        Used where the user gives none.
    bounds : (float, float)
        Default limits of a fit.
    scale : "linear" or "log"
        The coordinate q in which a fit moves: the value p itself, or log2 |p| for parameters that span
        decades.
    log_floor : float
        For scale "log": the smallest |p| a fit looks at when a bound is 0, in the parameter's unit.
    linear : bool
        Whether the BRDF is linear in it.
    given : "", "wavelength" or "user"
        "wavelength": not fitted, its value is the wavelength in nm. "user": it has no default, and a fit
        needs it fixed.

    Raises
    ------
    ValueError
        A name that is no identifier, bounds that do not increase or do not hold the default, or a log scale
        whose bounds change sign or reach 0 without a floor.
    """

    name: str
    unit: str
    default: float
    bounds: tuple[float, float]
    meaning: str
    scale: Literal["linear", "log"] = "linear"
    log_floor: float = 0.0
    linear: bool = False
    given: Literal["", "wavelength", "user"] = ""

    def __post_init__(self) -> None:
        low, high = self.bounds
        if not all(re.fullmatch("[A-Za-z][A-Za-z0-9_]*", part) for part in self.name.split(".")):
            raise ValueError(f"parameter {self.name!r}: a name is letters, digits and _, a letter first")
        if not (low < high and low <= self.default <= high):
            raise ValueError(f"parameter {self.name}: bounds {self.bounds} do not hold {self.default:g}")
        if self.scale == "log":
            if low < 0.0 < high:
                raise ValueError(f"parameter {self.name}: bounds {self.bounds} on a log scale change sign")
            if low * high == 0.0 and not self.log_floor > 0.0:
                raise ValueError(f"parameter {self.name}: a log scale that reaches 0 needs a log_floor")

    @property
    def sign(self) -> float:
        """Sign of all values within the default bounds: −1 or +1."""
        return -1.0 if self.bounds[1] <= 0.0 else 1.0

    @property
    def symbol(self) -> str:
        """The name as kernels write it: a dot between part and parameter becomes an underscore."""
        return self.name.replace(".", "_")

    def to_coordinate(self, value: npt.ArrayLike) -> Array:
        """Coordinate q of a value; on a log scale values nearer to 0 than `log_floor` map to the floor."""
        values = np.asarray(value, dtype=np.float64)
        if self.scale == "linear":
            return values
        least = self.log_floor or min(abs(self.bounds[0]), abs(self.bounds[1])) * 2.0**-100
        return np.log2(np.maximum(self.sign * values, least))

    def from_coordinate(self, coordinate: npt.ArrayLike) -> Array:
        """Value of a coordinate q."""
        coordinates = np.asarray(coordinate, dtype=np.float64)
        return coordinates if self.scale == "linear" else self.sign * np.exp2(coordinates)

    def slope(self, value: npt.ArrayLike) -> Array:
        """dp/dq at a value p."""
        values = np.asarray(value, dtype=np.float64)
        return np.ones_like(values) if self.scale == "linear" else values * np.log(2.0)

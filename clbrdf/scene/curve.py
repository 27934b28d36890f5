"""A parameter over wavelength, as a scene file writes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]


class Curve(TomlTable):
    """A number, pairs [nm, value], or {polynomial = [p0, p1, ...], centre = nm, scale = nm}.

    Between pairs lie straight lines, beyond them their first and last value; a polynomial is
    p0 + p1 t + p2 t² + ... with t = (λ − centre) / scale.

    Attributes
    ----------
    table : tuple of (float, float)
    polynomial : tuple of float
    centre, scale : float
        nm.
    """

    table: tuple[tuple[float, float], ...] = ()
    polynomial: tuple[float, ...] = ()
    centre: float = 0.0
    scale: Annotated[float, Field(gt=0.0)] = 1.0

    @model_validator(mode="before")
    @classmethod
    def _forms(cls, value: Any) -> Any:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return {"polynomial": [value]}
        if isinstance(value, list | tuple):
            if not all(isinstance(pair, list | tuple) and len(pair) == 2 for pair in value):
                raise ValueError("give a number, pairs [nm, value], or {polynomial = [...], centre, scale}")
            return {"table": value}
        if not isinstance(value, Mapping):
            raise ValueError("give a number, pairs [nm, value], or {polynomial = [...], centre, scale}")
        return value

    @model_validator(mode="after")
    def _check(self) -> Curve:
        if bool(self.table) == bool(self.polynomial):
            raise ValueError("give a number, pairs [nm, value], or {polynomial = [...], centre, scale}")
        places = [wavelength for wavelength, _ in self.table]
        if places != sorted(set(places)):
            raise ValueError("give pairs [nm, value] with increasing wavelengths")
        return self

    def at(self, wavelength: Array) -> Array:
        """Return the values at wavelengths in nm, of any shape."""
        if self.table:
            places, heights = zip(*self.table, strict=True)
            return np.asarray(np.interp(wavelength, places, heights))
        t = (wavelength - self.centre) / self.scale
        return np.asarray(np.polynomial.polynomial.polyval(t, self.polynomial))

"""What the arrays of a scan have to be like."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import check_finite, is_frozen

Array = npt.NDArray[np.float64]
T = TypeVar("T", bound=np.generic)


def checked_bands(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of bands as a tuple; raise InputError where they are no texts or repeat."""
    bands = tuple(names)
    if isinstance(names, str) or not all(isinstance(name, str) and name for name in bands):
        raise InputError(f"bands are {names!r}; give a name for each")
    if len(set(bands)) < len(bands):
        raise InputError(f"bands are {', '.join(bands)}; give each once")
    return bands


def widths(name: str, values: npt.ArrayLike, length: int) -> Array:
    """Return positive numbers (length,), NaN where unknown; one number stands for all."""
    given = np.asarray(values, dtype=np.float64)
    if given.shape not in ((), (length,)):
        raise InputError(f"{name} has shape {given.shape}; give {length} values or one")
    out = np.array(np.broadcast_to(given, (length,)))
    bad = ~(np.isnan(out) | ((out > 0.0) & np.isfinite(out)))
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(f"{name}[{place}] is {out[place]:g}; give a positive value, or NaN if unknown")
    return out


def checked_wavelength(values: npt.ArrayLike, bands: tuple[str, ...]) -> Array:
    """Return wavelengths (W,), nm; raise InputError, naming the place, where they are no increasing ones."""
    wavelength = np.array(values, dtype=np.float64, ndmin=1)
    if bands:
        if wavelength.shape != (len(bands),) or not np.isnan(wavelength).all():
            raise InputError(f"a scan of {len(bands)} bands has no wavelengths; give {len(bands)} NaN")
        return wavelength
    if wavelength.ndim != 1:
        raise InputError(f"wavelength has {wavelength.ndim} dimensions; give a one-dimensional array")
    check_finite("wavelength", wavelength)
    if (wavelength <= 0.0).any():
        place = int(np.argmax(wavelength <= 0.0))
        raise InputError(f"wavelength[{place}] is {wavelength[place]:g} nm; it has to be positive")
    falls = np.diff(wavelength) <= 0.0
    if falls.any():
        place = int(np.argmax(falls)) + 1
        word = "repeats" if wavelength[place] == wavelength[place - 1] else "follows"
        raise InputError(
            f"wavelength[{place}], {wavelength[place]:g} nm, {word} {wavelength[place - 1]:g} nm;"
            " sort the wavelengths and give each once"
        )
    return wavelength


def matrix(name: str, values: npt.ArrayLike, shape: tuple[int, int], dtype: type[T]) -> npt.NDArray[T]:
    """Return values of a shape and type, a copy unless nobody can write them; raise InputError else."""
    given = np.asarray(values)
    own = given.dtype == dtype and is_frozen(given)
    found = given if own else np.array(values, dtype=dtype)
    if found.shape != shape:
        raise InputError(
            f"{name} has shape {found.shape}; {shape[0]} directions × {shape[1]} wavelengths need {shape}"
        )
    return found

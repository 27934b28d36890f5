"""Headings of columns: wavelengths, bands, quantities with their units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.storage.units import LENGTH, LONGEST, SHORTEST, factor

Array = npt.NDArray[np.float64]

SPECTRAL = re.compile(
    r"\s*\(?\s*(\d+(?:\.\d*)?)\s*[_ ]?\s*\(?(nm|um|µm|μm|micron|micrometer|micrometre)?\)?\s*"
)
BAND_NAMES = {
    "r": "R",
    "g": "G",
    "b": "B",
    "red": "R",
    "green": "G",
    "blue": "B",
    "x": "X",
    "y": "Y",
    "z": "Z",
}


def wavelength_of(heading: str) -> float | None:
    """Return the wavelength that a heading gives, nm; None where it gives none with a unit."""
    match = SPECTRAL.fullmatch(heading.casefold())
    if match is None or match.group(2) is None:
        return None
    return float(match.group(1)) * factor(LENGTH, match.group(2))


def spectrum_of(path: Path, headings: Sequence[str]) -> tuple[Array, tuple[str, ...]]:
    """Return wavelengths, nm, or the names of bands, of columns of values.

    Raises
    ------
    InputError
        Headings that are partly wavelengths, name one twice, or lie beyond light.
    """
    waves = [wavelength_of(heading) for heading in headings]
    if all(wave is None for wave in waves):
        bands = tuple(BAND_NAMES.get(h.strip().casefold(), h.strip()) for h in headings)
        if len(set(bands)) < len(bands) or not all(bands):
            raise InputError(f"{path}: columns {', '.join(headings)}; name each column of values, and once")
        return np.empty(0), bands
    if any(wave is None for wave in waves):
        other = headings[waves.index(None)]
        raise InputError(f"{path}: column {other!r} is no wavelength, and others are; name it like 550nm")
    found = np.array(waves, dtype=np.float64)
    if len(np.unique(found)) < len(found):
        raise InputError(f"{path}: a wavelength heads two columns; keep one of them")
    if found.min() < SHORTEST or found.max() > LONGEST:
        bad = found[(found < SHORTEST) | (found > LONGEST)][0]
        raise InputError(f"{path}: {bad:g} nm is no wavelength of light; name the unit of the columns")
    return found, ()

"""Values over wavelength from a file, for a parameter that is not fitted: n and k of a metal, say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, shortened
from clbrdf.formats.text import read_text

Array = npt.NDArray[np.float64]

SLACK = 1e-6
"""nm by which a scan may reach beyond a spectrum: rounding of what the files print."""


def read_spectrum(path: Path, wavelength: Array) -> Array:
    """Return a value at each wavelength (W,), nm, straight lines between those of a CSV file.

    The file has two columns, wavelength in nm and value, one wavelength a line, in any order. A first line of
    names, empty lines and lines that begin with # are passed over.

    Raises
    ------
    InputError
        File missing or no text; a line that is not two numbers; a wavelength given twice; a spectrum that
        does not cover the wavelengths.
    """
    if not path.is_file():
        said = "no such file" if path.suffix else "neither a number nor a file"
        raise InputError(f"{path}: {said}; a spectrum is a CSV file of wavelength in nm, value")
    lines = read_text(path).lstrip("\ufeff").split("\n")
    values: dict[float, float] = {}
    heading_may_come = True
    for number, line in enumerate(lines, start=1):
        cells = _cells(line)
        if not cells or cells[0].startswith("#"):
            continue
        numbers = _numbers(cells)
        if numbers is None and heading_may_come and len(cells) >= 2:
            heading_may_come = False
            continue
        heading_may_come = False
        if numbers is None:
            raise InputError(
                f"{path}, line {number}: {shortened(repr(line))} is not a wavelength in nm and a value"
            )
        nm, value = numbers
        if nm in values:
            raise InputError(f"{path}, line {number}: {nm:g} nm is given twice")
        values[nm] = value
    if not values:
        raise InputError(f"{path}: holds no values; a spectrum is a CSV file of wavelength in nm, value")
    places = np.array(sorted(values))
    beyond = wavelength[(wavelength < places[0] - SLACK) | (wavelength > places[-1] + SLACK)]
    if len(beyond):
        raise InputError(
            f"{path}: runs from {places[0]:g} to {places[-1]:g} nm and does not cover the scan's"
            f" {wavelength.min():g} to {wavelength.max():g} nm; extend it, or leave wavelengths out"
        )
    return np.asarray(np.interp(wavelength, places, [values[nm] for nm in places]))


def _cells(line: str) -> list[str]:
    """Return the cells of a line; where semicolons stand between them, commas are decimal points."""
    if ";" in line:
        line = line.replace(",", ".").replace(";", ",")
    return [cell.strip().strip('"') for cell in re.split(r"[,\t]", line)] if line.strip() else []


def _numbers(cells: list[str]) -> tuple[float, float] | None:
    """Return the two numbers of a line, None where it holds something else."""
    try:
        nm, value = (float(cell) for cell in cells if cell.strip())
    except ValueError:
        return None
    return (nm, value) if np.isfinite([nm, value]).all() else None

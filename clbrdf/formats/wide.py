"""Tables with wavelengths as columns: one row a direction.

Angles stand in columns with names as in `quantities`, wavelengths head the others ("550nm"). Text may stand
above the heading; where it speaks of BRF or a reflectance factor, values are π f. Without azimuths zeniths
have signs, + on the specular side.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.columns_write import SETTLED
from clbrdf.formats.headings import spectrum_of, wavelength_of
from clbrdf.formats.quantities import ANGLES, find_columns, renamed
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.sheet import find_heading, open_sheet
from clbrdf.formats.text import read_text
from clbrdf.formats.wide_write import write

Array = npt.NDArray[np.float64]

FACTOR = re.compile(r"\bbrr?f\b|reflectance[ _]factor", re.IGNORECASE)
FUNCTION = re.compile(r"\bb[rst]df\b|1/sr|sr\^?-1", re.IGNORECASE)


def sniff(head: Head) -> int:
    """Return whether a line names an angle and wavelengths."""
    return SURE if head.text and find_heading(head.lines, _fits) is not None else NO


def is_wide(path: Path, names: Mapping[str, str]) -> bool:
    """Whether a file is a wide table when its headings stand for these names."""
    try:
        return _fits(
            list(open_sheet(path, read_text(path), _fits, partial(renamed, path, names=names)).names)
        )
    except InputError:
        return False


def _fits(cells: list[str]) -> bool:
    if not any(wavelength_of(cell) is not None for cell in cells):
        return False
    try:
        found = find_columns(Path(), cells, ANGLES)
    except InputError:
        return False
    return {"theta_i", "theta_r"} <= found.keys()


def read(path: Path, names: Mapping[str, str] | None = None) -> list[Reading]:
    """Read a wide table.

    Parameters
    ----------
    names : mapping of str to str, optional
        Headings of the file, and the names that they stand for.

    Raises
    ------
    InputError
        Naming line and column: no heading with angles and wavelengths, a column given twice, a line with
        too few or too many cells, text in a number.
    """
    text = read_text(path)
    sheet = open_sheet(path, text, _fits, partial(renamed, path, names=names) if names else None)
    if not _fits(list(sheet.names)):
        raise InputError(f"{path}: no line names theta_i, theta_r and wavelengths like 550nm")
    angles = find_columns(path, sheet.names, ANGLES)
    spectral = [k for k, name in enumerate(sheet.names) if wavelength_of(name) is not None]
    spectrum, bands = spectrum_of(path, [sheet.names[k] for k in spectral])
    blocks = list(sheet.blocks())
    columns = {
        name: np.concatenate([sheet.numbers(block, column.place) for block in blocks])
        * (1.0 if column.factor is None else column.factor)
        for name, column in angles.items()
    }
    values = np.concatenate(
        [np.stack([sheet.numbers(block, k, empty=True) for k in spectral], axis=1) for block in blocks]
    )
    n = len(values)
    azimuth = "phi" in columns or {"phi_i", "phi_r"} <= columns.keys()
    phi_i = columns["phi_i"] if "phi_i" in columns and "phi" not in columns else np.zeros(n)
    phi_r = columns.get("phi", columns.get("phi_r", np.zeros(n)))
    words = sheet.above + "\n" + "\n".join(line for line in text.split("\n") if line.lstrip().startswith("#"))
    scale = "pi" if FACTOR.search(words) else "1" if FUNCTION.search(words) else None
    order = np.argsort(spectrum)
    return [
        Reading(
            columns["theta_i"],
            phi_i,
            columns["theta_r"],
            phi_r if azimuth else np.zeros(n),
            np.ascontiguousarray(values[:, order]),
            spectrum[order],
            bands,
            Stated(sure=ALL)
            if text.lstrip("\ufeff").startswith(SETTLED)
            else Stated(
                angle="deg" if all(column.factor is not None for column in angles.values()) else None,
                forward=180.0 if azimuth else 0.0,
                scale=scale,
                sure=frozenset({"length"}),
            ),
            notes=sheet.notes(column.place for column in angles.values())
            + (() if azimuth else ("a zenith with + is taken to lie on the specular side",)),
            lines=np.array([line for block in blocks for line in block.lines], dtype=np.float64),
            sample=path.stem,
        )
    ]


FORMAT = Format(
    "wide", "CSV or tab table, wavelengths as columns", (".wide.csv",), sniff, read, write,
    "directions and wavelengths, no uncertainties", maps_names=True,
)  # fmt: skip

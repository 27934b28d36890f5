"""Measured BRDF as text in columns: one row a value (CSV), as described in `read_columns`."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.gather import Row, gather
from clbrdf.scan import Scan

ANGLE_UNITS = {"deg": 1.0, "rad": 180.0 / np.pi, "mrad": 0.18 / np.pi}
LENGTH_UNITS = {"nm": 1.0, "um": 1e3, "µm": 1e3, "μm": 1e3, "mm": 1e6, "m": 1e9, "angstrom": 0.1}
SHORTEST, LONGEST = 10.0, 1e6
"""nm; beyond, the unit of a column is wrong."""

BRDF_UNITS = {"per_sr": 1.0, "1_sr": 1.0, "sr-1": 1.0}


@dataclass(frozen=True)
class Quantity:
    """A column that may occur: its names without unit, the units it may have, and if it has to be there."""

    names: tuple[str, ...]
    units: dict[str, float] | None
    required: bool = True


QUANTITIES = {
    "wavelength": Quantity(("wavelength", "lambda"), LENGTH_UNITS),
    "theta_i": Quantity(("theta_i",), ANGLE_UNITS),
    "theta_r": Quantity(("theta_r", "theta_s", "theta_v"), ANGLE_UNITS),
    "phi": Quantity(("dphi", "phi", "delta_phi"), ANGLE_UNITS, required=False),
    "phi_i": Quantity(("phi_i",), ANGLE_UNITS, required=False),
    "phi_r": Quantity(("phi_r", "phi_s", "phi_v"), ANGLE_UNITS, required=False),
    "brdf": Quantity(("fr", "brdf"), BRDF_UNITS),
    "sigma": Quantity(("fr_std", "brdf_std", "fr_errors", "brdf_errors"), BRDF_UNITS, required=False),
    "sample": Quantity(("sample",), None, required=False),
    "flag": Quantity(("flag", "flags"), None, required=False),
}


def read_columns(paths: Sequence[str | Path], sample: str | None = None) -> Scan:
    """Read CSV files into one scan.

    The first line that is not empty and does not begin with # names the columns, in any order and any
    case; the unit is the end of the name:

    - ``wavelength_nm`` (or _um, _mm, _m, _angstrom), ``theta_i_deg``, ``theta_r_deg`` (or _rad, _mrad)
    - ``dphi_deg``, φr − φi with 180 forward; or ``phi_i_deg`` and ``phi_r_deg``
    - ``fr_per_sr`` or ``brdf_per_sr``; an empty cell is a value not measured
    - optional: ``fr_std_per_sr`` (1σ, may be empty), ``sample``, ``flag`` (reasons joined by ";"; any
      reason masks the value)

    Columns with other names are left out. The separator is the comma, the semicolon or the tab,
    whichever the first line has most of. A direction that occurs several times at one wavelength (a
    drift check, a repeat) makes as many directions of the scan.

    Parameters
    ----------
    paths : sequence of path
        Files that together hold the scan.
    sample : str, optional
        Which sample to take; needed where the files hold several.

    Raises
    ------
    InputError
        Naming file, line and column: a file that is missing, empty or not text, a column missing or
        given twice, a unit unknown, a line with too few or too many cells, text in a number, an angle or
        wavelength out of range, no such sample, or several and none chosen.
    """
    rows: list[Row] = []
    for path in paths:
        rows += _read_file(Path(path))
    names = sorted({row.sample for row in rows})
    listed = ", ".join(repr(name) for name in names)
    where = ", ".join(str(path) for path in paths)
    if sample is None and len(names) > 1:
        raise InputError(f"{where}: holds {len(names)} samples; choose one with --sample: {listed}")
    if sample is not None and sample not in names:
        raise InputError(f"{where}: no sample is called {sample!r}; there are {listed}")
    wanted = names[0] if sample is None else sample
    provenance = {"input": ", ".join(Path(path).name for path in paths), "format": "columns (CSV)"}
    return gather([row for row in rows if row.sample == wanted], wanted, provenance)


def _read_file(path: Path) -> list[Row]:
    if not path.exists():
        raise InputError(f"{path}: no such file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not a text file (byte {error.start} is no UTF-8); give a CSV file"
        ) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    lines = ((k, line) for k, line in enumerate(io.StringIO(text, newline=None), start=1))
    content = [(k, line) for k, line in lines if line.strip() and not line.lstrip().startswith("#")]
    if len(content) < 2:
        raise InputError(f"{path}: no data; the first line names the columns, the next ones hold values")
    separator = max(",;\t", key=content[0][1].count)
    header, *body = csv.reader((line for _, line in content), delimiter=separator)
    columns = _columns(path, header)
    return [
        _row(path, number, cells, len(header), columns)
        for (number, _), cells in zip(content[1:], body, strict=True)
    ]


def _columns(path: Path, header: Sequence[str]) -> dict[str, tuple[int, str, float]]:
    """Map each quantity found to (place, name as written, factor to deg, nm or 1/sr)."""
    found: dict[str, tuple[int, str, float]] = {}
    for place, cell in enumerate(header):
        written = cell.strip()
        match = _quantity(path, written)
        if match is None:
            continue
        quantity, factor = match
        if quantity in found:
            raise InputError(
                f"{path}: columns {found[quantity][1]!r} and {written!r} both give {quantity}; keep one"
            )
        found[quantity] = (place, written, factor)
    missing = [name for name, q in QUANTITIES.items() if q.required and name not in found]
    if "phi" not in found and not {"phi_i", "phi_r"} <= found.keys():
        missing.append("phi")
    if missing:
        first = QUANTITIES[missing[0]]
        unit = next(iter(first.units or {}))
        raise InputError(
            f"{path}: no column for {', '.join(missing)}; name it like {first.names[0]}_{unit}."
            f" Columns found: {', '.join(cell.strip() for cell in header)}"
        )
    return found


def _quantity(path: Path, written: str) -> tuple[str, float] | None:
    name = written.casefold()
    # Longest names first: fr_std_per_sr is not fr with the unit std_per_sr.
    known = sorted(
        ((stem, key) for key, q in QUANTITIES.items() for stem in q.names), key=lambda pair: -len(pair[0])
    )
    for stem, key in known:
        units = QUANTITIES[key].units
        if name == stem and units is None:
            return key, 1.0
        if units is not None and (name == stem or name.startswith(f"{stem}_")):
            unit = name[len(stem) + 1 :]
            if unit not in units:
                said = f"has the unit {unit!r}" if unit else "has no unit"
                raise InputError(f"{path}: column {written!r} {said}; known are {', '.join(units)}")
            return key, units[unit]
    return None


def _row(
    path: Path, line: int, cells: Sequence[str], width: int, columns: dict[str, tuple[int, str, float]]
) -> Row:
    if len(cells) != width:
        raise InputError(f"{path}, line {line}: {len(cells)} cells, and the first line names {width} columns")

    def text(quantity: str) -> str:
        return cells[columns[quantity][0]].strip() if quantity in columns else ""

    def value(quantity: str, empty: float = float("nan")) -> float:
        place, written, factor = columns[quantity]
        cell = cells[place].strip()
        if not cell and quantity in ("brdf", "sigma"):
            return empty
        try:
            return float(cell) * factor
        except ValueError:
            raise InputError(f"{path}, line {line}, column {written}: {cell!r} is not a number") from None

    def angle(quantity: str) -> float:
        degrees = value(quantity)
        written = columns[quantity][1]
        zenith = quantity.startswith("theta")
        if not np.isfinite(degrees) or (zenith and not 0.0 <= degrees < 90.0):
            rule = "zenith angles lie in [0°, 90°)" if zenith else "it has to be finite"
            raise InputError(
                f"{path}, line {line}, column {written}: {text(quantity)} is out of range; {rule}"
            )
        return degrees

    wavelength = value("wavelength")
    if not SHORTEST <= wavelength <= LONGEST:
        place = f"{path}, line {line}, column {columns['wavelength'][1]}"
        raise InputError(
            f"{place}: {text('wavelength')} is no wavelength of light in this unit; name the column"
            " wavelength_nm or wavelength_um, whichever it is"
        )
    phi_i = angle("phi_i") if "phi" not in columns else 0.0
    phi_r = angle("phi_r") if "phi" not in columns else angle("phi")
    reasons = {word.strip() for word in text("flag").split(";")} - {""}
    if not text("brdf"):
        reasons.add("not_measured")
    sigma = value("sigma") if "sigma" in columns else float("nan")
    if sigma < 0.0 or np.isinf(sigma):
        written = columns["sigma"][1]
        raise InputError(f"{path}, line {line}, column {written}: {text('sigma')} is no standard uncertainty")
    return Row(
        place=f"{path}, line {line}",
        sample=text("sample"),
        wavelength=wavelength,
        direction=(angle("theta_i"), phi_i % 360.0, angle("theta_r"), phi_r % 360.0),
        brdf=value("brdf"),
        sigma=sigma,
        reasons=frozenset(reasons),
    )

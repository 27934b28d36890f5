"""Measured BRDF as text in columns: one row a value.

The first line that is not empty and does not begin with # names the columns, in any order and any case; the
unit is the end of the name:

- ``wavelength_nm`` (or _um, _mm, _m, _angstrom), ``theta_i_deg``, ``theta_r_deg`` (or _rad, _mrad)
- ``dphi_deg``, φr − φi with 180 forward; or ``phi_i_deg`` and ``phi_r_deg``; without them zeniths have signs
- ``fr_per_sr`` or ``brdf_per_sr``; or ``reflectance_factor``, π f; an empty cell is a value not measured
- optional: ``fr_std_per_sr`` (1σ, may be empty), ``fr_std_common_per_sr`` (1σ of an error that all values
  have in common; ``fr_std_per_sr`` is that of the rest then), ``sample``, ``flag`` (reasons joined by ";";
  any reason masks the value), ``bandpass_nm``, ``solid_angle_sr``

Other names in use are known, too (``incidence``, ``emission``, ``azimuth``, …), and columns with other
names are left out. The separator is the comma, the semicolon, the tab or white space. A direction that occurs
several times at one wavelength (a drift check, a repeat) makes as many directions of the scan.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.formats.columns_write import SETTLED, write
from clbrdf.formats.quantities import LONG, VALUES, Column, find_columns, renamed
from clbrdf.formats.reading import SURE as SURE_ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import LIKELY, NO, SURE, Format, Head
from clbrdf.formats.sheet import Sheet, TextBlock, find_heading, open_sheet
from clbrdf.formats.table import long_reading
from clbrdf.formats.text import read_text
from clbrdf.scan.flags import FLAGS, MOST_FLAGS
from clbrdf.storage.units import LENGTH, LONGEST, SHORTEST

Array = npt.NDArray[np.float64]

MICROMETRE = LENGTH["um"]
TEXT_ENDINGS = (".csv", ".tsv", ".txt", ".dat")


def sniff(head: Head) -> int:
    """Return SURE where a line names a wavelength, zeniths and values; LIKELY for other text tables."""
    if not head.text:
        return NO
    lines = [line for line in head.lines if not line.startswith("#")]
    if find_heading(lines, _names_wavelengths) is not None:
        return SURE
    table = bool(lines) and any(mark in lines[0] for mark in ",;\t")
    return LIKELY if head.path.suffix.casefold() in TEXT_ENDINGS or table else NO


def _fits(cells: list[str]) -> bool:
    try:
        found = find_columns(Path(), cells, LONG)
    except InputError:
        return False
    return {"theta_i", "theta_r"} <= found.keys() and any(name in found for name in VALUES)


def _names_wavelengths(cells: list[str]) -> bool:
    return _fits(cells) and not {"wavelength", "band"}.isdisjoint(find_columns(Path(), cells, LONG))


@dataclass
class _Rows:
    """What is gathered block by block."""

    numbers: dict[str, list[Array]] = field(default_factory=dict)
    lines: list[Array] = field(default_factory=list)
    samples: list[npt.NDArray[np.intp]] = field(default_factory=list)
    flags: list[npt.NDArray[np.uint32]] = field(default_factory=list)
    sample_numbers: dict[str, int] = field(default_factory=dict)
    bands: dict[str, int] = field(default_factory=dict)
    reasons: dict[str, int] = field(default_factory=dict)


def read(path: Path, names: Mapping[str, str] | None = None) -> list[Reading]:
    """Read a table of columns: one reading a sample.

    Parameters
    ----------
    names : mapping of str to str, optional
        Headings of the file, and the names that they stand for.

    Raises
    ------
    InputError
        Naming line and column: a file that is empty or no text, a column missing or given twice, a unit
        unknown, a line with too few or too many cells, text in a number, no such thing as a σ.
    """
    text = read_text(path)
    sheet = open_sheet(path, text, _fits, partial(renamed, path, names=names) if names else None)
    columns = find_columns(path, sheet.names, LONG)
    value = _value_column(sheet, columns)
    rows = _Rows()
    for block in sheet.blocks():
        _gather(sheet, columns, value, block, rows)
    joined = {name: np.concatenate(parts) for name, parts in rows.numbers.items()}
    samples, flags = np.concatenate(rows.samples), np.concatenate(rows.flags)
    lines = np.concatenate(rows.lines)
    reasons = (*FLAGS, *(name for name in sorted(rows.reasons) if name not in FLAGS))
    flags = _translated(flags, rows.reasons, reasons)
    notes = sheet.notes(column.place for name, column in columns.items() if LONG[name].units is not None)
    text_start = text.lstrip("\ufeff")[: len(SETTLED)]
    stated = Stated(sure=SURE_ALL) if text_start == SETTLED else _stated(columns, value)
    bands = tuple(rows.bands)
    return [
        replace(
            _reading(
                path, joined, np.flatnonzero(samples == k), flags, reasons, lines, sample, stated, bands
            ),
            notes=notes,
        )
        for sample, k in sorted(rows.sample_numbers.items())
    ]


def _value_column(sheet: Sheet, columns: Mapping[str, Column]) -> str:
    values = [name for name in VALUES if name in columns]
    # Without wavelengths it may be a file of one, which the guard asks for.
    missing = [name for name in ("theta_i", "theta_r") if name not in columns]
    if not values:
        missing.append("brdf")
    if len(values) > 1:
        written = " and ".join(repr(columns[name].written) for name in values)
        raise InputError(f"{sheet.path}: columns {written} both give values; keep one")
    if missing and all(_is_number(name) for name in sheet.names):
        raise InputError(f"{sheet.path}: the first line holds numbers; put one above that names the columns")
    if missing:
        unit = {"brdf": "_per_sr"}.get(missing[0], "_deg")
        raise InputError(
            f"{sheet.path}: no column for {', '.join(missing)}; name it like"
            f" {LONG[missing[0]].names[0]}{unit}, or say which it is with"
            f" {advice('names', '--map')}. Columns found: {', '.join(sheet.names)}"
        )
    return values[0]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _stated(columns: Mapping[str, Column], value: str) -> Stated:
    angles = [columns[name] for name in ("theta_i", "theta_r", "phi", "phi_i", "phi_r") if name in columns]
    has_unit = all(column.factor is not None for column in angles)
    azimuth = "phi" in columns or {"phi_i", "phi_r"} <= columns.keys()
    return Stated(
        angle="deg" if has_unit else None,
        length=_length(columns),
        forward=180.0 if azimuth else None,
        cosine=value == "dsf",
        scale="pi" if value == "factor" else None if columns[value].factor is None else "1",
        sure=frozenset(),
    )


def _length(columns: Mapping[str, Column]) -> str | None:
    """Return the unit of wavelengths: µm as they stand, others in nm."""
    if "wavelength" not in columns:
        return "nm"
    factor = columns["wavelength"].factor
    return None if factor is None else "um" if factor == MICROMETRE else "nm"


def _gather(sheet: Sheet, columns: Mapping[str, Column], value: str, block: TextBlock, rows: _Rows) -> None:
    """Take the numbers and texts of a block."""

    def put(name: str, column: str, empty: bool = False) -> Array:
        factor = columns[column].factor
        if column == "wavelength" and factor == MICROMETRE:
            factor = 1.0  # the guard looks at them as they stand
        values = sheet.numbers(block, columns[column].place, empty) * (1.0 if factor is None else factor)
        rows.numbers.setdefault(name, []).append(values)
        return values

    def check(column: str, bad: npt.NDArray[np.bool_], rule: str) -> None:
        if bad.any():
            place = int(np.argmax(bad))
            where = f"{sheet.path}, line {block.lines[place]}, column {columns[column].written}"
            raise InputError(f"{where}: {block.cells[columns[column].place][place].strip()} {rule}")

    for name in ("theta_i", "theta_r"):
        values = put(name, name)
        check(name, ~np.isfinite(values), "is out of range; it has to be finite")
        check(name, np.abs(values) > 360.0, "is out of range; zenith angles lie in [0°, 90°)")
    for name in ("phi", "phi_i", "phi_r"):
        if name in columns:
            check(name, ~np.isfinite(put(name, name)), "is out of range; it has to be finite")
    n = len(block.lines)
    if "wavelength" in columns:
        _wavelengths(columns, put, check)
    else:
        cells = block.cells[columns["band"].place] if "band" in columns else ("",) * n
        names = [text.strip() for text in cells]
        places = [rows.bands.setdefault(name, len(rows.bands)) for name in names]
        rows.numbers.setdefault("wavelength", []).append(np.array(places, dtype=np.float64))
    values = put("values", value, empty=True)
    for name in ("bandpass", "solid_angle"):
        if name in columns:
            put(name, name, empty=True)
    for name in ("sigma", "common"):
        if name in columns:
            sigma = put(name, name, empty=True)
            check(name, (sigma < 0.0) | np.isinf(sigma), "cannot be a standard uncertainty; give 0 or more")
    rows.lines.append(np.array(block.lines, dtype=np.float64))
    samples = block.cells[columns["sample"].place] if "sample" in columns else ("",) * n
    numbers = [
        rows.sample_numbers.setdefault(" ".join(text.split()), len(rows.sample_numbers)) for text in samples
    ]
    rows.samples.append(np.array(numbers, dtype=np.intp))
    flags = np.zeros(n, np.uint32)
    if "flag" in columns:
        for k, cell in enumerate(block.cells[columns["flag"].place]):
            for word in cell.split(";") if cell.strip() else ():
                if word.strip():
                    flags[k] |= np.uint32(1 << _bit(sheet, word.strip(), rows.reasons))
    empty = [not cell.strip() for cell in block.cells[columns[value].place]] if np.isnan(values).any() else []
    if any(empty):
        flags[np.array(empty)] |= np.uint32(1 << _bit(sheet, "not_measured", rows.reasons))
    rows.flags.append(flags)


def _wavelengths(
    columns: Mapping[str, Column], put: Callable[..., Array], check: Callable[..., None]
) -> None:
    wavelength = put("wavelength", "wavelength")
    check("wavelength", ~(np.isfinite(wavelength) & (wavelength > 0.0)), "is no wavelength of light")
    nm = wavelength * (MICROMETRE if columns["wavelength"].factor == MICROMETRE else 1.0)
    light = (nm >= SHORTEST) & (nm <= LONGEST)
    # Where none is light, the unit is another, which the guard sees; where some are not, those are wrong.
    if light.any() and columns["wavelength"].factor is not None:
        rule = "is no wavelength of light in this unit; name the column wavelength_nm or wavelength_um"
        check("wavelength", ~light, rule)


def _bit(sheet: Sheet, reason: str, reasons: dict[str, int]) -> int:
    place = reasons.setdefault(reason, len(reasons))
    own = len([name for name in reasons if name not in FLAGS])
    if own > MOST_FLAGS - len(FLAGS):
        raise InputError(f"{sheet.path}: {own} different flags; at most {MOST_FLAGS - len(FLAGS)} are kept")
    return place


def _translated(
    flags: npt.NDArray[np.uint32], reasons: Mapping[str, int], names: tuple[str, ...]
) -> npt.NDArray[np.uint32]:
    out = np.zeros_like(flags)
    for reason, place in reasons.items():
        out[(flags & np.uint32(1 << place)) != 0] |= np.uint32(1 << names.index(reason))
    return out


def _reading(
    path: Path,
    columns: Mapping[str, Array],
    rows: npt.NDArray[np.intp],
    flags: npt.NDArray[np.uint32],
    names: tuple[str, ...],
    lines: Array,
    sample: str,
    stated: Stated,
    bands: tuple[str, ...],
) -> Reading:
    n = len(rows)
    theta_r = columns["theta_r"][rows]
    if "phi_i" in columns and "phi_r" in columns:
        phi_i, phi_r = columns["phi_i"][rows], columns["phi_r"][rows]
    elif "phi" in columns:
        phi_i, phi_r = np.zeros(n), columns["phi"][rows]
    elif (theta_r < 0.0).any() or (columns["theta_i"] < 0.0).any():
        phi_i, phi_r = np.zeros(n), np.zeros(n)
    else:
        raise InputError(
            f"{path}: no column for phi; name it like dphi_deg, 180 forward, or give zeniths their signs"
        )
    waves, back = np.unique(columns["wavelength"][rows], return_inverse=True)
    bands = tuple(bands[int(k)] for k in waves) if bands else ()
    keys = np.stack([columns["theta_i"][rows], phi_i, theta_r, phi_r], axis=1)
    places = np.asarray(back.reshape(-1), dtype=np.intp)
    extra = {
        name: _one_value(columns[name][rows], places, len(waves), name == "bandpass")
        for name in ("bandpass", "solid_angle")
        if name in columns
    }
    return long_reading(
        path,
        keys,
        columns["values"][rows],
        places,
        np.empty(0) if bands else waves,
        bands,
        stated,
        sigma=columns["sigma"][rows] if "sigma" in columns else None,
        common=columns["common"][rows] if "common" in columns else None,
        flags=flags[rows],
        lines=lines[rows],
        flag_names=names,
        sample=sample,
        extra=extra,
    )


def _one_value(values: Array, column: npt.NDArray[np.intp], count: int, by_column: bool) -> Array | float:
    """Return a bandpass for each wavelength, or one solid angle for all where it is the same."""
    if not by_column:
        return float(values[0]) if (values == values[0]).all() else float("nan")
    out = np.full(count, np.nan)
    out[column] = values
    return out


FORMAT = Format(
    "columns", "CSV, one row a value (also reflectance factors)", (".csv",), sniff, read, write,
    "everything but polarisation", maps_names=True,
)  # fmt: skip

"""Arguments that several commands share, and how their texts are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
from cyclopts import Parameter, Token

from clbrdf.errors import InputError, shortened
from clbrdf.fit.spectrum_file import read_spectrum
from clbrdf.grid import MOST_POINTS, spaced
from clbrdf.scan import Scan

Output = Annotated[Path, Parameter(name=["--output", "-o"], help="file to write")]
Overwrite = Annotated[bool, Parameter(name="--overwrite", negative="", help="replace an existing file")]
DeviceName = Annotated[
    str | None, Parameter(name="--device", help="part of the name of an OpenCL device or platform")
]
CsvFile = Annotated[
    Path | None, Parameter(name="--csv", help="also write the parameters as a table, one row a wavelength")
]
JsonFile = Annotated[Path | None, Parameter(name="--json", help="also write the result for machines")]


def _whole(_type: object, tokens: Sequence[Token]) -> int:
    """Read a whole number; "1.5" is none."""
    try:
        return int(tokens[0].value)
    except ValueError:
        # The command line puts the name of the option before it.
        raise ValueError(f"{shortened(repr(tokens[0].value))} is no whole number; give one") from None


Seed = Annotated[int, Parameter(converter=_whole)]


def number_list(name: str, text: str) -> npt.NDArray[np.float64]:
    """Read "30,45,60" or "0:85:5" (start:stop:step, both ends included).

    Raises
    ------
    InputError
        Anything else, or more than a million values.
    """
    values: list[float] = []
    for part in text.split(","):
        try:
            numbers = [float(word) for word in part.split(":")]
        except ValueError:
            numbers = []
        if len(numbers) == 1:
            values += numbers
        elif len(numbers) == 3:
            try:
                values += spaced(*numbers)
            except ValueError as error:
                raise InputError(f"{name} {shortened(part)}: {error}") from None
        else:
            said = shortened(repr(part))
            raise InputError(f"{name}: {said} is neither a number nor start:stop:step, as in 0:85:5")
        if len(values) > MOST_POINTS:
            raise InputError(f"{name}: {len(values)} values; at most {MOST_POINTS} are read")
    return np.array(values)


def fixed_map(texts: list[str]) -> dict[str, float | Path]:
    """Read "n=1.5" or "n=silver.csv" texts, one parameter each: a number, or the file of a spectrum.

    Raises
    ------
    InputError
        A text of another form, or a name given twice.
    """
    values: dict[str, float | Path] = {}
    for text in texts:
        name, _, value = (word.strip() for word in text.partition("="))
        if not (name and value):
            raise InputError(f"--fix {text!r}: write name=number or name=FILE.csv, as in --fix n=1.5")
        if name in values:
            raise InputError(f"--fix: {name} is given twice; give each parameter once")
        try:
            values[name] = float(value)
        except ValueError:
            values[name] = Path(value)
    return values


def column_map(texts: list[str]) -> dict[str, str]:
    """Read "Angle in=theta_i_deg" texts: a heading of a table, and the name that it stands for.

    Raises
    ------
    InputError
        A text of another form, or a column or a name given twice.
    """
    names: dict[str, str] = {}
    for text in texts:
        column, _, name = (word.strip() for word in text.rpartition("="))
        if not (name and column):
            raise InputError(f'--map {text!r}: write column=name, as in --map "Angle in=theta_i_deg"')
        if column in names or name in names.values():
            raise InputError(f"--map {text!r}: {column if column in names else name} is given twice")
        names[column] = name
    return names


def at_wavelengths(
    fixed: Mapping[str, float | Path], scan: Scan
) -> dict[str, float | npt.NDArray[np.float64]]:
    """Return fixed parameters with the spectra of files at a scan's wavelengths.

    Raises
    ------
    InputError
        A file that is no spectrum, or that does not cover the scan.
    """
    return {
        name: read_spectrum(value, scan.wavelength) if isinstance(value, Path) else value
        for name, value in fixed.items()
    }


def fix_words(fixed: Mapping[str, float | Path]) -> list[str]:
    """Return the texts of --fix as provenance tells them: files by their names alone."""
    return [f"{name}={value.name if isinstance(value, Path) else value}" for name, value in fixed.items()]


def name_list(texts: list[str]) -> tuple[str, ...]:
    """Read names, several of them possibly joined by commas."""
    return tuple(name.strip() for text in texts for name in text.split(",") if name.strip())


def parameter_map(texts: list[str], option: str = "--param") -> dict[str, float]:
    """Read "ks=451.8" texts of an option, several of them possibly joined by commas.

    Raises
    ------
    InputError
        A text without "=", or a value that is no number.
    """
    values: dict[str, float] = {}
    for text in ",".join(texts).split(",") if texts else []:
        name, equals, value = (word.strip() for word in text.partition("="))
        if name in values:
            raise InputError(f"{option}: {name} is given twice; give each parameter once")
        try:
            values[name] = float(value)
        except ValueError:
            raise InputError(f"{option} {text!r}: write name=number, as in {option} ks=451.8") from None
        if not equals:
            raise InputError(f"{option} {text!r}: write name=number, as in {option} ks=451.8")
    return values


def pair_map(texts: list[str]) -> dict[str, tuple[float, float]]:
    """Read "d=0.2:2" texts, several of them possibly joined by commas.

    Raises
    ------
    InputError
        A text of another form.
    """
    pairs: dict[str, tuple[float, float]] = {}
    for text in ",".join(texts).split(",") if texts else []:
        name, _, limits = (word.strip() for word in text.partition("="))
        try:
            lower, upper = (float(word) for word in limits.split(":"))
        except ValueError:
            raise InputError(f"--bounds {text!r}: write name=lower:upper, as in --bounds d=0.5:1") from None
        if name in pairs:
            raise InputError(f"--bounds: {name} is given twice; give each parameter once")
        pairs[name] = (lower, upper)
    return pairs

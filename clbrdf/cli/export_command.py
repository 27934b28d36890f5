"""`clbrdf export`: a fit or a scan in other people's formats."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter

from clbrdf.cli.export_table import Chosen, export_table
from clbrdf.cli.options import Output, Overwrite, number_list
from clbrdf.errors import InputError
from clbrdf.files import check_apart
from clbrdf.formats.registry import format_for_writing


def command(
    file: Path,
    /,
    *,
    output: Output,
    format_: Annotated[str | None, Parameter(name="--format")] = None,
    tolerance: str = "0.5%",
    wavelength: str | None = None,
    side: Literal["reflection", "transmission"] | None = None,
    phi_i: float | None = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a fit or a scan in another format, found by the ending of the name or given with --format.

    A scan is written as it was measured. A fit is evaluated: for formats with a grid of their own the grid
    grows until values between its nodes are within the tolerance, and what it reached is printed; for tables
    in the directions that were fitted. 'clbrdf formats' lists what each format holds.

    Parameters
    ----------
    file
        fit or scan
    format_
        the format, where the ending does not tell it
    tolerance
        sum of errors over sum of values at the worst wavelength, as in 0.5% or 0.005
    wavelength
        those to write, nm, as in 400:700:10; the nearest there are
    side
        only this side of a scan
    phi_i
        only this incident azimuth of a scan, degrees
    """
    check_apart([output], [file])
    kind = format_for_writing(output, format_)
    chosen = Chosen(None if wavelength is None else number_list("--wavelength", wavelength), side, phi_i)
    export_table(file, output, kind, read_tolerance(tolerance), chosen, overwrite)


def read_tolerance(text: str) -> float:
    """Read "0.5%" or "0.005".

    Raises
    ------
    InputError
        No positive number.
    """
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(%?)\s*", text)
    try:
        value = float(found[1]) if found else np.nan
    except ValueError:
        value = np.nan
    if found is None or not value > 0.0:
        raise InputError(f"--tolerance {text!r} is no positive number; write 0.5% or 0.005")
    return value / 100.0 if found[2] else value

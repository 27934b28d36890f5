"""`clbrdf export`: a fit or a scan in other people's formats."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter

from clbrdf.cli.export_rgl import Colour, export_rgl
from clbrdf.cli.export_table import Chosen, export_table
from clbrdf.cli.options import Output, Overwrite, number_list
from clbrdf.colour import DEFAULT_ILLUMINANT
from clbrdf.errors import InputError
from clbrdf.formats.registry import format_for_writing
from clbrdf.storage.files import check_apart


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
    rgb: Annotated[bool, Parameter(negative="")] = False,
    illuminant: str | None = None,
    false_colour: str | None = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a fit or a scan in another format, found by the ending of the name or given with --format.

    A scan is written as it was measured, but for rgl, which interpolates it. A fit is evaluated: for formats
    with a grid of their own the grid grows until values between its nodes are within the tolerance, and what
    it reached is printed; for tables in the directions that were fitted. 'clbrdf formats' lists what each
    format holds.

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
    rgb
        for rgl and merl: three bands of linear sRGB in place of wavelengths
    illuminant
        light that --rgb is for: D65 (the default), D50, A, E, FL2 or FL11
    false_colour
        for rgl: three wavelengths, nm, as red, green and blue, as in 650,550,450
    """
    check_apart([output], [file])
    kind = format_for_writing(output, format_)
    chosen = Chosen(None if wavelength is None else number_list("--wavelength", wavelength), side, phi_i)
    colour = Colour(
        rgb, illuminant, None if false_colour is None else number_list("--false-colour", false_colour)
    )
    if kind.name == "rgl":
        export_rgl(file, output, read_tolerance(tolerance), chosen, colour, overwrite)
    elif kind.name == "merl" and colour.false_colour is None:
        light = (illuminant or DEFAULT_ILLUMINANT) if rgb or illuminant is not None else None
        export_table(file, output, kind, read_tolerance(tolerance), chosen, overwrite, light)
    elif colour.asked:
        raise InputError(f"{colour.asked} is for rgl files, and this is to be {kind.name}; leave it out")
    else:
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

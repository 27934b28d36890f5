"""`clbrdf export`: a fit or a scan in other people's formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.cli.export_rgl import export_rgl, read_tolerance
from clbrdf.cli.options import Output, Overwrite, number_list
from clbrdf.colour import DEFAULT_ILLUMINANT
from clbrdf.files import check_apart


def command(
    file: Path,
    /,
    *,
    output: Output,
    tolerance: str = "0.5%",
    rgb: Annotated[bool, Parameter(negative="")] = False,
    illuminant: str = DEFAULT_ILLUMINANT,
    false_colour: str | None = None,
    wavelength: str | None = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a fit, or a scan that can be interpolated, as a tensor .bsdf that Mitsuba renders.

    The grid grows until the file, read back, is within the tolerance, and what it reached is printed.

    Parameters
    ----------
    file
        fit or scan
    tolerance
        Σ|error|/Σ|f| at the worst wavelength, as in 0.5% or 0.005
    rgb
        three bands of linear sRGB in place of wavelengths
    illuminant
        light that --rgb is for: D65, D50, A, E, FL2 or FL11
    false_colour
        three wavelengths, nm, as red, green and blue, as in 650,550,450
    wavelength
        those to write, nm, as in 400:700:10; the nearest there are
    """
    check_apart([output], [file])
    chosen = None if wavelength is None else number_list("--wavelength", wavelength)
    bands = None if false_colour is None else number_list("--false-colour", false_colour)
    export_rgl(file, output, read_tolerance(tolerance), rgb, illuminant, bands, chosen, overwrite)

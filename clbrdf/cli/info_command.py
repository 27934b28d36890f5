"""`clbrdf info`: what is in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf import hdf5
from clbrdf.cli.console import print_table
from clbrdf.cli.summary import print_fit, print_scan
from clbrdf.fit.result import Fit
from clbrdf.scan import Scan


def command(file: Path, /, *, all_rows: Annotated[bool, Parameter(negative="")] = False) -> None:
    """Show what is in a scan or fit file.

    Parameters
    ----------
    file
        a scan or fit
    all_rows
        every wavelength of a fit, however many
    """
    with hdf5.open_file(file) as opened:
        content = hdf5.content_of(opened)
    print_scan(str(file), Scan.open(file))
    if content == "fit":
        fit = Fit.open(file)
        print_fit("", fit, all_rows)
        print_table("", ("made by", ""), [[k, v] for k, v in fit.provenance.items()], left=2)

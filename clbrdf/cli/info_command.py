"""`clbrdf info`: what is in a file, or how far a running measurement is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.choose import Choice
from clbrdf.cli.checks import print_fit_checks
from clbrdf.cli.choice_table import print_choice
from clbrdf.cli.console import print_table
from clbrdf.cli.options import CsvFile, Overwrite
from clbrdf.cli.summary import print_fit, print_scan, print_scans
from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.rig.follow import Progress
from clbrdf.rig.follow import follow as follow_measurement
from clbrdf.scan import Scan, open_scans
from clbrdf.storage import hdf5


def command(
    file: Path,
    /,
    *,
    all_rows: Annotated[bool, Parameter(negative="")] = False,
    follow: Annotated[bool, Parameter(negative="")] = False,
    csv: CsvFile = None,
    overwrite: Overwrite = False,
) -> None:
    """Show what is in a scan or fit file; of a fit also its reflectance, and whether it is reciprocal.

    Of a fit that 'clbrdf choose' wrote, the ranking of the models comes first.

    Several scans in one file are listed; file.h5::name shows one of them.

    Parameters
    ----------
    file
        a scan or fit, or one scan of several as in file.h5::name
    all_rows
        every wavelength of a fit, however many
    follow
        the file is being measured by another process: show how far it is until it is complete
    """
    if follow:
        follow_measurement(file, _show)
    with hdf5.open_file(file) as opened:
        content = hdf5.content_of(opened)
    if csv is not None and content != "fit":
        raise InputError(f"--csv: {file} holds a {content}, and the table is of a fit's parameters")
    if content == "scan" and len(scans := open_scans(file)) > 1:
        print_scans(str(file), scans)
        return
    print_scan(str(file), Scan.open(file))
    if content == "fit":
        fit = Fit.open(file)
        if csv is not None:
            fit.to_csv(csv, overwrite)
        if Choice.is_in(file):
            print_choice(str(file), Choice.open(file))
        print_fit("", fit, all_rows)
        print_fit_checks(fit)
        print_table("", ("made by", ""), [[k, v] for k, v in fit.provenance.items()], left=2)


def _show(progress: Progress) -> None:
    left = f", about {progress.remaining:.0f} s left" if progress.remaining == progress.remaining else ""
    place = f"{progress.points} of {progress.total} points"
    print(f"{progress.latest or 'no point yet'}: {place}{left}", flush=True)

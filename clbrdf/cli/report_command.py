"""`clbrdf report`: figures and tables of a fit on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.choose import Choice
from clbrdf.cli.console import progress_bar, stderr_console
from clbrdf.cli.options import DeviceName, Overwrite
from clbrdf.device import choose_device
from clbrdf.errors import InputError
from clbrdf.fit import Fit


def command(
    fit: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"], help="folder to write to")],
    device: DeviceName = None,
    overwrite: Overwrite = False,
) -> None:
    """Write report.html, one page that needs nothing else, with the table and the lobes beside it.

    Parameters
    ----------
    fit
        fit file; of one that 'clbrdf choose' wrote, the page begins with the ranking of the models
    """
    from clbrdf.viz.report import write_report

    choice = Choice.open(fit) if Choice.is_in(fit) else None
    result = Fit.open(fit) if choice is None else choice.fit
    if result.scan.bands:
        names = ", ".join(result.scan.bands)
        raise InputError(
            f"{fit}: a report draws over wavelengths, and the fit has the bands {names};"
            " 'clbrdf info' shows its table"
        )
    chosen = choose_device(device)
    with progress_bar("drawing the report") as report:
        files, missing = write_report(result, output, overwrite, chosen, report, choice)
    told = stderr_console()
    for file in files:
        told.print(f"wrote {file}", soft_wrap=True)
    if missing:
        told.print(f"without lobes: {missing}", soft_wrap=True)

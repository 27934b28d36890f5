"""`clbrdf report`: a fit on one page, that computes or with still pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from clbrdf.choose import Choice
from clbrdf.cli.console import progress_bar, stderr_console
from clbrdf.cli.options import DeviceName, Overwrite
from clbrdf.errors import InputError
from clbrdf.fit import Fit
from clbrdf.opencl.device import choose_device
from clbrdf.storage.files import check_apart, check_output

PAGE_ENDINGS = (".html", ".htm")


def command(
    files: Annotated[list[Path], Parameter(negative_iterable="", consume_multiple=True)],
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"], help="FILE.html, or a folder")],
    figures: Literal["svg", "pdf", "png"] | None = None,
    device: DeviceName = None,
    overwrite: Overwrite = False,
) -> None:
    """Write one page that needs nothing else.

    With -o FILE.html it computes: maps, lobe, cut and spectrum of fits and scans, at any incident angle, in
    any browser, without a server or a network. With -o FOLDER it is report.html, with still pictures of one
    fit, and the table and the lobes beside it.

    Parameters
    ----------
    files
        fit file; of one that 'clbrdf choose' wrote, the report in a folder begins with the ranking of the
        models; for a page that computes also several, and scans
    figures
        into a folder: each flat figure also as a file of its own
    """
    if output.suffix.casefold() in PAGE_ENDINGS and not output.is_dir():
        if figures is not None:
            raise InputError(
                "--figures belongs to a report in a folder; a page saves each of its panels itself"
            )
        write_page(files, output, overwrite)
        return
    if len(files) != 1:
        raise InputError(f"a folder takes the report of one fit, not of {len(files)}; or write -o FILE.html")
    from clbrdf.viz.report import write_report

    choice = Choice.open(files[0]) if Choice.is_in(files[0]) else None
    result = Fit.open(files[0]) if choice is None else choice.fit
    if result.scan.bands:
        names = ", ".join(result.scan.bands)
        raise InputError(
            f"{files[0]}: a report draws over wavelengths, and the fit has the bands {names};"
            " 'clbrdf info' shows its table"
        )
    chosen = choose_device(device)
    with progress_bar("drawing the report") as report:
        written, missing = write_report(result, output, overwrite, chosen, report, choice, figures)
    told = stderr_console()
    for file in written:
        told.print(f"wrote {file}", soft_wrap=True)
    if missing:
        told.print(f"without lobes: {missing}", soft_wrap=True)


def write_page(files: list[Path], output: Path, overwrite: bool, start: str = "") -> None:
    """Write the page that computes, and say so."""
    from clbrdf.viz.page import open_for_page, save_page

    check_output(output, overwrite)
    check_apart([output], files)
    subjects = [open_for_page(path) for path in files]
    size = save_page(subjects, output, overwrite, start)
    told = stderr_console()
    told.print(f"wrote {output}, {size / 1e6:.2g} MB", soft_wrap=True)

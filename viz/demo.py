"""The pictures that the demo leaves behind."""

from __future__ import annotations

from pathlib import Path

from clbrdf.fit.result import Fit
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.viz.page import PageSubject, save_page
from clbrdf.viz.report import write_report


def demo_pictures(
    fit: Fit,
    folder: str | Path,
    overwrite: bool = False,
    device: Device | None = None,
    report: Report = silent,
) -> tuple[list[Path], list[str]]:
    """Write report, lobes and the page that computes into a folder; go on without what is missing here.

    Parameters
    ----------
    fit : Fit
    folder : path
        Made if it does not exist.
    overwrite : bool
    device : Device, optional
        Evaluates the lobes.
    report : callable
        Called with (steps done, steps in all).

    Returns
    -------
    (list of Path, list of str)
        The files, and a line for everything that could not be made: no OpenGL.

    Raises
    ------
    InputError
        A file exists and `overwrite` is False, or the folder cannot be made.
    """
    files, missing = write_report(fit, folder, overwrite, device, report)
    page = Path(folder) / "brdf.html"
    save_page([PageSubject(fit.scan.sample or "a sample", fit.scan, fit)], page, overwrite)
    return [*files, page], [f"no lobes: {missing}"] if missing else []

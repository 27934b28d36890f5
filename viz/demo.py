"""The pictures that the demo leaves behind."""

from __future__ import annotations

from pathlib import Path

from clbrdf.device import Device
from clbrdf.errors import ClbrdfError
from clbrdf.fit.result import Fit
from clbrdf.progress import Report, silent
from clbrdf.viz.report import write_report


def demo_pictures(
    fit: Fit,
    folder: str | Path,
    overwrite: bool = False,
    device: Device | None = None,
    report: Report = silent,
) -> tuple[list[Path], list[str]]:
    """Write the report, the lobes and a page that turns into a folder; go on without what is missing here.

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
        The files, and a line for everything that could not be made: no OpenGL, no trame.

    Raises
    ------
    InputError
        A file exists and `overwrite` is False, or the folder cannot be made.
    """
    files, missing = write_report(fit, folder, overwrite, device, report)
    if missing:
        return files, [f"no lobes: {missing}"]
    from clbrdf.viz.html import save_html
    from clbrdf.viz.panel import Entry
    from clbrdf.viz.scene import Scene
    from clbrdf.viz.style import Look
    from clbrdf.viz.subject import Subject

    subject = Subject(fit.scan.sample or "a sample", fit.scan, fit)
    entry = Entry(subject, subject.default_wavelength(), subject.default_incident())
    scene = Scene([entry], Look(radius="log"), words=False, flat_labels=True, device=device)
    page = Path(folder) / "lobe.html"
    try:
        save_html(scene, page, overwrite)
    except ClbrdfError as error:
        return files, [f"no page that turns: {error}"]
    finally:
        scene.close()
    return [*files, page], []

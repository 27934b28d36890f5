"""A fit on one page: the paper's figures, tables, lobes, warnings and provenance, in one HTML file."""

from __future__ import annotations

import io
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clbrdf.choose.result import Choice
from clbrdf.errors import ClbrdfError, InputError
from clbrdf.fit.result import Fit
from clbrdf.fit.words import departure_lines
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.storage.files import check_output, whole_file, whole_text
from clbrdf.viz.choice_report import choice_sections
from clbrdf.viz.curves import measured_and_model, save_figure, spectral_map
from clbrdf.viz.graphics import GraphicsError, require_off_screen
from clbrdf.viz.report_parts import STYLE, cell, figure, image, pairs, section, table
from clbrdf.viz.report_words import (
    budget_words,
    fit_table,
    mean_words,
    provenance_rows,
    summary_rows,
    warning_lines,
)
from clbrdf.viz.spectra import parameter_spectra, quality_spectra, spectra_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("report.html", "parameters.csv", "lobes.png", "lobes_log.png")
LOBE_PANELS = 4


def write_report(
    fit: Fit,
    folder: str | Path,
    overwrite: bool = False,
    device: Device | None = None,
    report: Report = silent,
    choice: Choice | None = None,
    kind: str | None = None,
) -> tuple[list[Path], str]:
    """Write the page and its parts into a folder, which is made if it does not exist.

    Parameters
    ----------
    fit : Fit
    folder : path
    overwrite : bool
        Whether files of an earlier report are replaced.
    device : Device, optional
        Evaluates the lobes.
    report : callable
        Called with (steps done, steps in all).
    choice : Choice, optional
        That the fit came from: the page then begins with the ranking of the models.
    kind : "svg", "pdf" or "png", optional
        Also write each flat figure as a file of its own, of this kind.

    Returns
    -------
    (list of Path, str)
        The files, and in one line why there are no lobes, "" if there are.

    Raises
    ------
    InputError
        A file exists and `overwrite` is False, or the folder cannot be made.
    """
    target = Path(folder)
    if target.exists() and not target.is_dir():
        raise InputError(f"{target}: is a file; name a folder, or a page that ends in .html, with -o")
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made ({error.strerror}); name another with -o") from error
    figures = _figures(fit)
    files = [*FILES, *(f"{name}.{kind}" for name, *_ in figures if kind)]
    for name in files:
        check_output(target / name, overwrite)
    steps = len(figures) + 2
    sections = [] if choice is None else choice_sections(choice)
    written = []
    for k, (name, title, caption, draw, inside) in enumerate(figures):
        sections.append(section(title, figure(draw, inside, caption)))
        if kind:
            written += _own_file(draw, target / f"{name}.{kind}", overwrite)
        report(k + 1, steps)
    pictures, missing = _lobes(fit, device)
    report(len(figures) + 1, steps)
    if missing:
        sections.append(section("Lobes", f'<p class="warning">Not drawn: {escape(missing)}</p>'))
    else:
        shown = [image(data, "image/png", words) for data, words in pictures]
        sections.append(section("Lobes", "\n".join(shown)))
    if len(fit.estimate.parts) > 1:
        sections.append(section("What makes the error bars", _budget(fit)))
    names, rows = fit_table(fit)
    sections.append(section("Table of the fit", f'<div class="long">{table(names, rows)}</div>'))
    sections.append(section("Provenance", pairs(provenance_rows(fit))))
    for (data, _), name in zip(pictures, FILES[2:], strict=False):
        with whole_file(target / name, overwrite) as part:
            part.write_bytes(data)
        written.append(target / name)
    lines = [",".join(names), *(",".join(cell(v, 10) for v in row) for row in rows)]
    csv = "\n".join(lines) + "\n"
    whole_text(target / "parameters.csv", csv, overwrite)
    whole_text(target / "report.html", _page(fit, sections), overwrite)
    report(steps, steps)
    return [target / "report.html", target / "parameters.csv", *written], missing


Figures = list[tuple[str, str, str, Callable[[], "Figure"], str]]


def _own_file(draw: Callable[[], Figure], path: Path, overwrite: bool) -> list[Path]:
    """Write a figure to a file, where it can be drawn."""
    try:
        drawn = draw()
    except InputError:
        return []  # the report says why
    save_figure(drawn, path, overwrite)
    return [path]


def _figures(fit: Fit) -> Figures:
    """Name, title, caption, how it is drawn, and the kind inside the report, of every flat figure."""
    return [
        (
            "curves",
            "Measured and model",
            "Points: measured; lines: model; below: deviation (Figs. 9–11).",
            lambda: measured_and_model(fit),
            "svg",
        ),
        (
            "spectrum",
            "BRDF over wavelength and view angle",
            "Measured above, model below (Fig. 5).",
            lambda: spectral_map(fit),
            "png",
        ),
        (
            "parameters",
            "Parameters over wavelength",
            f"{spectra_words(fit)} Open marks: uncertainty unknown, at a bound or not determined by the data."
            " Crosses: not converged.",
            lambda: parameter_spectra(fit),
            "svg",
        ),
        (
            "quality",
            "Quality of the fit",
            "E of (13) with the weights used; σr of (14) for each incident zenith (Table 2).",
            lambda: quality_spectra(fit),
            "svg",
        ),
    ]


def _budget(fit: Fit) -> str:
    """Return the tables of components and of means over wavelengths, and what draws say beside them."""
    parts = [
        "<p>1σ by component, median over wavelengths. An error that many values have in common goes through"
        " as a whole.</p>",
        table(*budget_words(fit)),
    ]
    names, means = mean_words(fit)
    if means:
        parts += ["<p>Means over wavelengths, with the correlations between them.</p>", table(names, means)]
    if fit.monte_carlo is not None:
        lines = departure_lines(fit.monte_carlo, fit.model.names, fit.wavelength)
        told = "".join(f"<li>{escape(line)}</li>" for line in lines)
        parts.append(f"<p>Monte Carlo of {fit.monte_carlo.draws} draws (JCGM 101):</p><ul>{told}</ul>")
    return "\n".join(parts)


def _page(fit: Fit, sections: list[str]) -> str:
    name = escape(fit.scan.sample or "a sample")
    warnings = "".join(f'<p class="warning">{escape(line)}</p>' for line in warning_lines(fit))
    head = section("Warnings", warnings or "<p>None: every wavelength converged, nothing is masked.</p>")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}: BRDF fit</title>'
        f'<link rel="icon" href="data:,"><style>{STYLE}</style></head>\n<body><h1>{name}: BRDF fit</h1>\n'
        + "\n".join([pairs(summary_rows(fit)), head, *sections])
        + "\n</body></html>\n"
    )


def _lobes(fit: Fit, device: Device | None) -> tuple[list[tuple[bytes, str]], str]:
    """Return PNGs with their captions, and why there are none."""
    try:
        require_off_screen()
        return lobe_pictures(fit, device), ""
    except GraphicsError as error:
        return [], str(error)
    except ClbrdfError as error:
        return [], str(error)


def lobe_pictures(fit: Fit, device: Device | None = None) -> list[tuple[bytes, str]]:
    """Draw the lobes of up to four incident angles, linear and logarithmic, as PNGs with captions."""
    from PIL import Image

    from clbrdf.viz.panel import LobeRequest
    from clbrdf.viz.picture import Picture
    from clbrdf.viz.stills import pixels
    from clbrdf.viz.style import LobeStyle
    from clbrdf.viz.subject import Subject

    subject = Subject(fit.scan.sample or "a sample", fit.scan, fit)
    angles = fit.scan.incident_angles
    chosen = angles[np.unique(np.linspace(0, len(angles) - 1, LOBE_PANELS).round().astype(int))]
    wavelength = subject.default_wavelength()
    requests = [LobeRequest(subject, wavelength, float(a)) for a in chosen]
    out = []
    looks = (
        (LobeStyle(radius="linear"), "The radius is the BRDF."),
        (LobeStyle(radius="log"), "The radius is its logarithm."),
    )
    for look, words in looks:
        picture = Picture(requests, look, device=device)
        data = io.BytesIO()
        Image.fromarray(pixels(picture)).save(data, format="PNG")
        picture.close()
        out.append((data.getvalue(), f"Lobes at {wavelength:g} nm, one scale. {words}"))
    return out

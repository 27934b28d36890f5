"""Scans and fits in a few lines of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from rich.table import Table

from clbrdf.cli.console import make_table, number, print_table, stdout_console
from clbrdf.cli.uncertainty_tables import print_components, print_draws, print_parts, total_words
from clbrdf.fit.result import Fit
from clbrdf.fit.tables import (
    GIVEN_WORDS,
    MOST_ANGLES,
    Column,
    has_given,
    remark_rows,
    summary_rows,
    tables,
)
from clbrdf.geometry import ANGLES
from clbrdf.scan import Scan
from clbrdf.scan.average import spread_of_repeats
from clbrdf.scan.effects import effect_rows
from clbrdf.scan.rectangle import group_numbers

MOST_REMARKS = 12
"""Remarks on a fit that are printed."""

FEW_ANGLES = 6

LEAST_APART = 1e-4
"""Share by which repeats have to differ to be told so: less is how a file prints numbers."""

SHOWN_ROWS = 24
"""Wavelengths in a printed table, where there are more and not all are asked for."""


def print_scan(title: str, scan: Scan) -> None:
    """Print what is in a scan."""
    rows = [["sample", scan.sample or "–"], ["instrument", scan.instrument or "–"]]
    rows += _direction_rows(scan)
    rows.append(["bands" if scan.bands else "wavelengths", spectrum(scan)])
    if scan.bandpass is not None:
        rows.append(["bandpass", f"{_span(scan.bandpass)} nm"])
    if scan.solid_angle is not None:
        rows.append(["receiver", f"{_span(scan.solid_angle)} sr"])
    rows += [[name, text] for name, text in effect_rows(scan.effects)]
    if {scan.source_polarisation, scan.detector_polarisation} != {"unknown"}:
        rows.append(["polarisation", f"{scan.source_polarisation} in, {scan.detector_polarisation} out"])
    good = ~scan.mask
    if good.any():
        values = scan.brdf[good]
        rows.append(["BRDF", f"{number(values.min())} to {number(values.max())} 1/sr"])
    if scan.sigma is not None:
        known = np.isfinite(scan.sigma) & good & (scan.sigma > 0.0)
        text = f"for {np.count_nonzero(known)} values"
        positive = known & (scan.brdf > 0.0)
        if positive.any():
            text += f", median {100 * np.median(scan.sigma[positive] / scan.brdf[positive]):.3g} %"
        for count, word in (
            (np.count_nonzero(good & np.isnan(scan.sigma)), "have none"),
            (np.count_nonzero(good & (scan.sigma == 0.0)), "have 0"),
        ):
            text += f"; {count} {word}" if count else ""
        rows.append(["uncertainties", text])
        if scan.components:
            rows.append(["of them", total_words(scan)])
    text = f"{np.count_nonzero(scan.mask)} of {scan.brdf.size} values"
    reasons = ", ".join(f"{name} {count}" for name, count in scan.flag_counts().items())
    rows.append(["masked", f"{text} ({reasons})" if reasons else text])
    if scan.mask.all():
        rows.append(["to be fitted", "nothing: every value is masked; look at the values of the file"])
    rows += [[_origin(key), value] for key, value in scan.provenance.items()]
    print_table(title, ("scan", ""), rows, left=2)
    print_components(scan)


def _origin(key: str) -> str:
    """Return what a key of the provenance is called in a table."""
    kind, _, rest = key.partition("_")
    if kind == "guard":
        return f"taken: {rest.partition('_')[2]}"
    return "read" if kind == "read" else f"made by: {key}"


def print_scans(title: str, scans: Mapping[str, Scan]) -> None:
    """Print the scans of one file, a line each."""
    rows = [
        [name, scan.sample or "–", _sides(scan), spectrum(scan), str(len(scan)), str(int(scan.mask.sum()))]
        for name, scan in scans.items()
    ]
    columns = ("name", "sample", "side", "wavelengths or bands", "directions", "masked")
    print_table(title, columns, rows, left=4)


def spectrum(scan: Scan) -> str:
    """Return the wavelengths or bands of a scan in words."""
    if scan.bands:
        return ", ".join(scan.bands)
    first, last, w = scan.wavelength[0], scan.wavelength[-1], len(scan.wavelength)
    return f"{first:g} nm" if w == 1 else f"{w} from {first:g} to {last:g} nm"


def _sides(scan: Scan) -> str:
    """Return "reflection", "transmission" or both."""
    beyond = scan.transmitted
    return "both" if beyond.any() and not beyond.all() else str(scan.side[0])


def _span(values: npt.NDArray[np.float64]) -> str:
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return "–"
    low, high = known.min(), known.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _direction_rows(scan: Scan) -> list[list[str]]:
    """Rows on the directions of a scan."""
    n, repeats = len(scan.theta_i), _repeats(scan)
    beyond = int(np.count_nonzero(scan.transmitted))
    angles, counts = np.unique(scan.theta_i, return_counts=True)
    listed = ", ".join(
        f"{angle:g}° × {count}" for angle, count in zip(angles[:MOST_ANGLES], counts, strict=False)
    )
    rows = [
        ["directions", f"{n}, {repeats}" if repeats else str(n)],
        ["incident zeniths", listed if len(angles) <= MOST_ANGLES else _values(angles)],
        ["view zeniths", f"{scan.theta_r.min():g}° to {scan.theta_r.max():g}°"],
        ["azimuths φ", _values(np.unique(scan.phi))],
    ]
    if beyond:
        rows.insert(1, ["of transmission", f"{beyond}, where the view zenith is above 90°"])
    if (scan.phi_i != scan.phi_i[0]).any():
        rows.append(["incident azimuths", _values(np.unique(scan.phi_i))])
    return rows


def _repeats(scan: Scan) -> str:
    """Return how many directions are repeats, and how far apart the values of one lie; "" where none is."""
    count = scan.repeated_directions()
    if not count:
        return ""
    apart = spread_of_repeats(scan, group_numbers(np.stack([getattr(scan, name) for name in ANGLES], axis=1)))
    told = f", whose values differ by up to {100.0 * apart:.2g} %" if apart > LEAST_APART else ""
    return f"{count} of them repeats{told}"


def _values(angles: npt.NDArray[np.float64]) -> str:
    """Return angles one by one where they are few, else how many and their span."""
    if len(angles) <= FEW_ANGLES:
        return ", ".join(f"{angle:g}°" for angle in angles)
    return f"{len(angles)} from {angles[0]:g}° to {angles[-1]:g}°"


def print_fit(title: str, fit: Fit, all_rows: bool = False) -> None:
    """Print the parameters of a fit with their uncertainties, how good they are, and how it went."""
    w = len(fit.wavelength)
    shown = np.arange(w)
    if not all_rows and w > SHOWN_ROWS:
        shown = np.linspace(0, w - 1, SHOWN_ROWS).round().astype(np.intp)
    note = "" if len(shown) == w else f" ({len(shown)} of {w} wavelengths; --all-rows shows every one)"
    console = stdout_console()
    for place, (told, columns) in enumerate(tables(fit, shown, console.width)):
        console.print(_table(told if place else title + note, columns), crop=False)
    if has_given(fit):
        more = "the intervals above do not need that" if fit.intervals else "--profile finds intervals"
        console.print(f" {GIVEN_WORDS}; {more}\n")
    print_table("", ("fit", ""), summary_rows(fit), left=2)
    print_parts(fit)
    print_draws(fit)
    rows = remark_rows(fit)
    if len(rows) > MOST_REMARKS:
        rows = [*rows[:MOST_REMARKS], (f"and {len(rows) - MOST_REMARKS} more, in the fit file", "")]
    if rows:
        print_table("", ("remarks", "wavelengths"), rows, left=2)


def _table(title: str, columns: Sequence[Column]) -> Table:
    return make_table(
        title, [name for name, _ in columns], zip(*(c for _, c in columns), strict=True), left=0
    )

"""Scans and fits in a few lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from rich.measure import Measurement
from rich.table import Table

from clbrdf.cli.console import make_table, number, print_table, stdout_console
from clbrdf.fit.identifiability import by_remark
from clbrdf.fit.result import Fit
from clbrdf.scan import Scan

MOST_REMARKS = 8
"""Remarks on what the data leave open."""

SHOWN_ROWS = 24
"""Wavelengths in a printed table, where there are more and not all are asked for."""


def print_scan(title: str, scan: Scan) -> None:
    """Print what is in a scan."""
    rows = [["sample", scan.sample or "–"], ["instrument", scan.instrument or "–"]]
    rows += _direction_rows(scan)
    first, last, w = scan.wavelength[0], scan.wavelength[-1], len(scan.wavelength)
    rows.append(["wavelengths", f"{first:g} nm" if w == 1 else f"{w} from {first:g} to {last:g} nm"])
    good = ~scan.mask
    if good.any():
        values = scan.brdf[good]
        rows.append(["BRDF", f"{number(values.min())} to {number(values.max())} 1/sr"])
    if scan.sigma is not None:
        known = np.isfinite(scan.sigma) & good & (scan.sigma > 0.0)
        text = f"for {np.count_nonzero(known)} values"
        if known.any():
            text += f", median {100 * np.median(scan.sigma[known] / scan.brdf[known]):.3g} %"
        rows.append(["uncertainties", text])
    text = f"{np.count_nonzero(scan.mask)} of {scan.brdf.size} values"
    reasons = ", ".join(f"{name} {count}" for name, count in scan.flag_counts().items())
    rows.append(["masked", f"{text} ({reasons})" if reasons else text])
    rows += [[f"made by: {key}", value] for key, value in scan.provenance.items()]
    print_table(title, ("scan", ""), rows, left=2)


def _direction_rows(scan: Scan) -> list[list[str]]:
    """Rows on the directions of a scan."""
    n, repeats = len(scan.theta_i), scan.repeated_directions()
    angles = sorted(Counter(scan.theta_i.tolist()).items())
    azimuths = np.unique(scan.phi)
    few = ", ".join(f"{phi:g}°" for phi in azimuths)
    many = f"{len(azimuths)} from {azimuths[0]:g}° to {azimuths[-1]:g}°"
    return [
        ["directions", f"{n}, {repeats} of them repeats" if repeats else str(n)],
        ["incident zeniths", ", ".join(f"{angle:g}° × {count}" for angle, count in angles)],
        ["view zeniths", f"{scan.theta_r.min():g}° to {scan.theta_r.max():g}°"],
        ["azimuths φ", few if len(azimuths) <= 6 else many],
    ]


def print_fit(title: str, fit: Fit, all_rows: bool = False) -> None:
    """Print the table of a fit, as the paper's Tables 1 and 2 (σr in percent), and how it went."""
    w = len(fit.wavelength)
    shown = np.arange(w)
    if not all_rows and w > SHOWN_ROWS:
        shown = np.linspace(0, w - 1, SHOWN_ROWS).round().astype(np.intp)
    note = "" if len(shown) == w else f" ({len(shown)} of {w} wavelengths; --all-rows shows every one)"
    name, *parameters = _columns(fit, shown)
    deviations = [
        (f"σr {angle:g}°", [number(100.0 * row[k], 3) for k in shown])
        for angle, row in zip(fit.scan.incident_angles, fit.relative_rms_by_incident_angle, strict=True)
    ]
    status = ("status", [str(fit.status[k]) for k in shown])
    console = stdout_console()
    whole = _table(title + note, [name, *parameters, *deviations, status])
    unbounded = console.options.update(width=10_000)
    if Measurement.get(console, unbounded, whole).maximum <= console.width:
        console.print(whole, crop=False)
    else:
        console.print(_table(title + note, [name, *parameters, status]), crop=False)
        console.print(_table("σr (%) for each incident zenith", [name, *deviations]), crop=False)
    counts = ", ".join(f"{count} {status}" for status, count in Counter(fit.status.tolist()).most_common())
    good = np.isfinite(fit.objective)
    worst = fit.objective[good].max(initial=0.0)
    lines = [
        ["status", counts],
        ["method", f"{fit.method}, seed {fit.seed}, weights {fit.provenance.get('weights', '–')}"],
        [
            "E (13)",
            f"median {number(np.median(fit.objective[good]))}, worst {number(worst)}",
        ],
        ["σr (14)", f"median {number(100 * np.median(fit.relative_rms[good]), 3)} % over all directions"],
        ["evaluations", f"{int(np.median(fit.evaluations[good]))} a wavelength"],
        [
            "same end",
            f"{int(np.median(fit.agreeing[good]))} of {int(np.median(fit.starts[good]))} starts (median)",
        ],
        ["condition", f"median {number(np.median(fit.condition[good]), 3)}, of the scaled derivatives"],
        ["not finite", f"{int(fit.not_finite.sum())} evaluations, refused"],
        ["masked", f"{np.count_nonzero(fit.scan.mask)} of {fit.scan.brdf.size} values"],
        ["device", fit.device],
    ]
    if np.isfinite(fit.seconds):
        lines.append(
            ["time", f"{fit.seconds:.2f} s, {1e3 * fit.seconds / max(1, good.sum()):.3g} ms a wavelength"]
        )
    if np.isfinite(fit.acceptance).any():
        lines.insert(5, ["moves taken", f"{100 * np.nanmedian(fit.acceptance):.0f} %"])
    for k, text in enumerate(fit.tolerance):
        lines.insert(2 + k, ["next better" if k else "for the rtol", text])
    print_table("", ("fit", ""), lines, left=2)
    _print_remarks(fit)


def _print_remarks(fit: Fit) -> None:
    """Print what the data leave open, and where."""
    found = by_remark(fit.remarks, fit.wavelength)
    if not found:
        return
    rows = []
    for text, nm in found[:MOST_REMARKS]:
        span = f"{nm[0]:g} nm" if len(nm) == 1 else f"{len(nm)} from {nm[0]:g} to {nm[-1]:g} nm"
        rows.append([text, "everywhere" if len(nm) == len(fit.wavelength) else span])
    if len(found) > MOST_REMARKS:
        rows.append([f"and {len(found) - MOST_REMARKS} more, in the fit file", ""])
    print_table("", ("the data leave open", "wavelengths"), rows, left=2)


Column = tuple[str, list[str]]


def _columns(fit: Fit, shown: npt.NDArray[np.intp]) -> list[Column]:
    """Wavelength, parameters and E as columns of text."""
    values = [("λ (nm)", fit.wavelength, 6), *((n, v, 4) for n, v in fit.parameters.items())]
    return [
        (name, [number(float(column[k]), digits) for k in shown])
        for name, column, digits in (*values, ("E", fit.objective, 4))
    ]


def _table(title: str, columns: Sequence[Column]) -> Table:
    return make_table(
        title, [name for name, _ in columns], zip(*(c for _, c in columns), strict=True), left=0
    )

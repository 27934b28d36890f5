"""Scans and fits in a few lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from rich.measure import Measurement
from rich.table import Table

from clbrdf.cli.console import make_table, number, print_table, stdout_console
from clbrdf.cli.uncertainty_tables import print_components, print_draws, print_parts, total_words
from clbrdf.fit.gls import ASSUMES
from clbrdf.fit.result import Fit
from clbrdf.fit.words import gathered, search_lines
from clbrdf.scan import Scan

MOST_REMARKS = 8
"""Remarks on what the data leave open."""

MOST_ANGLES = 24
"""Incident zeniths listed one by one, or given columns of a table."""

FEW_ANGLES = 6

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
        rows.append(["uncertainties", text])
        if scan.components:
            rows.append(["of them", total_words(scan)])
    text = f"{np.count_nonzero(scan.mask)} of {scan.brdf.size} values"
    reasons = ", ".join(f"{name} {count}" for name, count in scan.flag_counts().items())
    rows.append(["masked", f"{text} ({reasons})" if reasons else text])
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
    n, repeats = len(scan.theta_i), scan.repeated_directions()
    beyond = int(np.count_nonzero(scan.transmitted))
    angles, counts = np.unique(scan.theta_i, return_counts=True)
    listed = ", ".join(
        f"{angle:g}° × {count}" for angle, count in zip(angles[:MOST_ANGLES], counts, strict=False)
    )
    rows = [
        ["directions", f"{n}, {repeats} of them repeats" if repeats else str(n)],
        ["incident zeniths", listed if len(angles) <= MOST_ANGLES else _values(angles)],
        ["view zeniths", f"{scan.theta_r.min():g}° to {scan.theta_r.max():g}°"],
        ["azimuths φ", _values(np.unique(scan.phi))],
    ]
    if beyond:
        rows.insert(1, ["of transmission", f"{beyond}, where the view zenith is above 90°"])
    if (scan.phi_i != scan.phi_i[0]).any():
        rows.append(["incident azimuths", _values(np.unique(scan.phi_i))])
    return rows


def _values(angles: npt.NDArray[np.float64]) -> str:
    """Return angles one by one where they are few, else how many and their span."""
    if len(angles) <= FEW_ANGLES:
        return ", ".join(f"{angle:g}°" for angle in angles)
    return f"{len(angles)} from {angles[0]:g}° to {angles[-1]:g}°"


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
        for angle, row in zip(
            fit.scan.incident_angles, fit.goodness.relative_rms_by_incident_angle, strict=True
        )
    ]
    if len(deviations) > MOST_ANGLES:
        deviations = []
    status = ("status", [str(fit.status[k]) for k in shown])
    console = stdout_console()
    whole = _table(title + note, [name, *parameters, *deviations, status])
    unbounded = console.options.update(width=10_000)
    if Measurement.get(console, unbounded, whole).maximum <= console.width:
        console.print(whole, crop=False)
    else:
        console.print(_table(title + note, [name, *parameters, status]), crop=False)
        if deviations:
            console.print(_table("σr (%) for each incident zenith", [name, *deviations]), crop=False)
    counts = ", ".join(f"{count} {status}" for status, count in Counter(fit.status.tolist()).most_common())
    good, search = np.isfinite(fit.objective), fit.search
    worst = fit.objective[good].max(initial=0.0)
    lines = [
        ["status", counts],
        ["method", f"{fit.setup.method}, seed {fit.setup.seed}, weights {fit.setup.weighting}"],
        [
            "E (13)",
            f"median {number(np.median(fit.objective[good]))}, worst {number(worst)}",
        ],
        ["σr (14)", f"median {number(100 * np.median(fit.relative_rms[good]), 3)} % over all directions"],
        ["evaluations", f"{int(np.median(search.evaluations[good]))} a wavelength"],
        [
            "starts that agree",
            f"{int(np.median(search.agreeing[good]))} of {int(np.median(search.starts[good]))} (median)",
        ],
        [
            "condition",
            f"median {number(np.median(fit.estimate.condition[good]), 3)}, of the scaled derivatives",
        ],
        ["not finite", f"{int(search.not_finite.sum())} evaluations, refused"],
        ["masked", f"{np.count_nonzero(fit.scan.mask)} of {fit.scan.brdf.size} values"],
        ["device", search.device],
    ]
    held = fixed_words(fit)
    if fit.setup.gls:
        lines.insert(2, ["assumed", ASSUMES])
    lines[2:2] = [*([["fixed", held]] if held else []), *(["shared", text] for text in shared_words(fit))]
    if fit.setup.left_out:
        lines.append(["left out", f"{fit.setup.left_out} directions, those of transmission"])
    if np.isfinite(search.seconds):
        lines.append(
            [
                "time",
                f"{search.seconds:.2f} s, {1e3 * search.seconds / max(1, good.sum()):.3g} ms a wavelength",
            ]
        )
    if np.isfinite(search.acceptance).any():
        lines.insert(5, ["moves taken", f"{100 * np.nanmedian(search.acceptance):.0f} %"])
    for k, text in enumerate(search_lines(fit.search)):
        lines.insert(2 + k, ["next better" if k else "chosen search", text])
    if fit.monte_carlo is not None and np.isfinite(fit.monte_carlo.seconds):
        lines.append(["Monte Carlo", f"{fit.monte_carlo.draws} draws, {fit.monte_carlo.seconds:.1f} s of it"])
    print_table("", ("fit", ""), lines, left=2)
    print_parts(fit)
    print_draws(fit)
    _print_remarks(fit)


def fixed_words(fit: Fit) -> str:
    """Return what was not fitted, with its value where it is one for all wavelengths."""
    words = []
    for name in fit.given:
        values = fit.parameters[name][np.isfinite(fit.parameters[name])]
        if len(values) and fit.model.parameter(name).given != "wavelength":
            one = values.min() == values.max()
            words.append(f"{name} = {number(float(values[0]), 5)}" if one else f"{name}, a spectrum")
    return ", ".join(words)


def shared_words(fit: Fit) -> list[str]:
    """Return what is one number for all wavelengths, with its error bar, a line each."""
    out = []
    for name in fit.shared:
        good = np.flatnonzero(np.isfinite(fit.parameters[name]))
        if len(good):
            value, sigma = fit.parameters[name][good[0]], fit.sigma[name][good[0]]
            bar = f" ± {sigma:.2g}" if np.isfinite(sigma) else ""
            out.append(f"{name} = {number(float(value), 5)}{bar}, one number for all wavelengths")
    return out


def _print_remarks(fit: Fit) -> None:
    """Print what the data leave open, and where."""
    found = gathered(fit.remarks, fit.wavelength)
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
    values = [*((n, v, 4) for n, v in fit.parameters.items()), ("E", fit.objective, 4)]
    bands = fit.scan.bands
    first = (
        ("band", [bands[k] for k in shown])
        if bands
        else ("λ (nm)", [f"{fit.wavelength[k]:.6g}" for k in shown])
    )
    return [
        first,
        *((name, [number(float(column[k]), digits) for k in shown]) for name, column, digits in values),
    ]


def _table(title: str, columns: Sequence[Column]) -> Table:
    return make_table(
        title, [name for name, _ in columns], zip(*(c for _, c in columns), strict=True), left=0
    )

"""A fit as tables of text: parameters with their uncertainties, how good they are, and how it went."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.fit.gls import ASSUMES
from clbrdf.fit.words import gathered, plain, search_lines, through_lines

if TYPE_CHECKING:
    from clbrdf.fit.result import Fit

Places = npt.NDArray[np.intp]
Column = tuple[str, list[str]]

MOST_ANGLES = 24
"""Incident zeniths that are given columns of a table."""

GIVEN = "*"
"""Marks an uncertainty that holds with another parameter at its limit."""

GIVEN_WORDS = f"{GIVEN} given that another parameter stays at its limit: this may be far too small"


def concise(value: float, sigma: float) -> str:
    """Return a value with its standard uncertainty in its last digits, as 0.02562(13).

    The uncertainty has two digits (GUM, 7.2.2 and 7.2.6).
    """
    if not math.isfinite(value) or not math.isfinite(sigma) or sigma <= 0.0:
        return plain(value, 4)
    size = max(abs(value), sigma)
    power = math.floor(math.log10(size)) if not 1e-3 <= size < 1e6 else 0
    v, s = value / 10.0**power, sigma / 10.0**power
    decimals = 1 - math.floor(math.log10(float(f"{s:.1e}")))
    tail = f"e{power:+03d}" if power else ""
    if decimals <= 0:
        return f"{round(v, decimals):.0f}({round(s, decimals):.0f}){tail}"
    digits = f"{s:.{decimals}f}" if s >= 0.995 else f"{s * 10.0**decimals:.0f}"
    return f"{v:.{decimals}f}({digits}){tail}"


def wavelength_column(fit: Fit, shown: Places) -> Column:
    """Return what the rows of a table are called."""
    bands = fit.scan.bands
    if bands:
        return "band", [bands[k] for k in shown]
    return "λ (nm)", [f"{fit.wavelength[k]:.6g}" for k in shown]


def parameter_columns(fit: Fit, shown: Places) -> list[Column]:
    """Return a column for each parameter, values with their uncertainties."""
    estimate, names = fit.estimate, fit.model.names
    held = np.asarray(estimate.at_bound.any(axis=1))

    def cell(k: int, j: int) -> str:
        value, sigma = float(estimate.vector[k, j]), float(estimate.sigma[k, j])
        if estimate.at_bound[k, j]:
            return f"{plain(value, 4)} limit"
        if estimate.undetermined[k, j] and math.isinf(sigma):
            return f"{plain(value, 4)}(∞)"
        return concise(value, sigma) + (GIVEN if held[k] and math.isfinite(sigma) else "")

    return [(name, [cell(int(k), j) for k in shown]) for j, name in enumerate(names)]


def quality_columns(fit: Fit, shown: Places) -> list[Column]:
    """Return E, χ²/ν where uncertainties are known, and σr of (14) for each incident zenith."""
    found = fit.goodness
    columns = [("E", [plain(float(found.objective[k]), 4) for k in shown])]
    if np.isfinite(found.chi2_reduced).any():
        columns.append(("χ²/ν", [plain(float(found.chi2_reduced[k]), 3) for k in shown]))
    angles = fit.scan.incident_angles
    if len(angles) <= MOST_ANGLES:
        columns += [
            (f"σr {angle:g}°", [plain(100.0 * float(row[k]), 3) for k in shown])
            for angle, row in zip(angles, found.relative_rms_by_incident_angle, strict=True)
        ]
    return columns


def status_column(fit: Fit, shown: Places) -> Column:
    """Return statuses, with "misfit" where the model does not describe the data."""
    poor = fit.misfit

    def cell(k: int) -> str:
        status = str(fit.status[k])
        return status if not poor[k] else "misfit" if status == "converged" else f"{status}, misfit"

    return "status", [cell(int(k)) for k in shown]


def columns_width(columns: Sequence[Column]) -> int:
    """Return how many characters columns take side by side, with two beside each."""
    return sum(max([len(name), *map(len, cells)]) + 2 for name, cells in columns)


def in_blocks(
    first: Column, columns: Sequence[Column], last: Sequence[Column], width: int
) -> list[list[Column]]:
    """Return columns as tables of at most `width` characters, each between the same first and last ones."""
    blocks: list[list[Column]] = []
    for column in columns:
        if not blocks or columns_width([first, *blocks[-1], column, *last]) > width:
            blocks.append([])
        blocks[-1].append(column)
    # Of even sizes, where that is narrow enough, too.
    size = -(-len(columns) // max(1, len(blocks)))
    even = [list(columns[k : k + size]) for k in range(0, len(columns), size)] if blocks else []
    if all(columns_width([first, *block, *last]) <= width for block in even):
        blocks = even
    return [[first, *block, *last] for block in blocks]


def interval_columns(fit: Fit, shown: Places) -> list[Column]:
    """Return a column for each parameter with its profile-likelihood interval; none without intervals."""
    estimate = fit.estimate
    if estimate.lower is None or estimate.upper is None:
        return []
    columns = []
    for j, name in enumerate(fit.model.names):
        if name in fit.given:
            continue
        cells = []
        for k in shown:
            low, high = float(estimate.lower[k, j]), float(estimate.upper[k, j])
            known = math.isfinite(low) and math.isfinite(high)
            ends = [
                plain(end, 4) + (" limit" if end == bound else "")
                for end, bound in zip((low, high), fit.setup.bounds[j], strict=True)
            ]
            cells.append(" to ".join(ends) if known else "–")
        columns.append((name, cells))
    return columns


def tables(fit: Fit, shown: Places, width: int) -> list[tuple[str, list[Column]]]:
    """Return the tables of a fit as (title, columns): one where it is narrow enough, else several."""
    first, status = wavelength_column(fit, shown), status_column(fit, shown)
    parameters, quality = parameter_columns(fit, shown), quality_columns(fit, shown)
    intervals = [
        ("intervals of 68.3 %, by profile likelihood", block)
        for block in in_blocks(first, interval_columns(fit, shown), [], width)
    ]
    whole = [first, *parameters, *quality, status]
    if columns_width(whole) <= width:
        return [("", whole), *intervals]
    title = "E (13), χ²/ν, and σr (14) in % at each incident zenith"
    if len(quality) < 2 or not quality[1][0].startswith("χ"):
        title = "E (13), and σr (14) in % at each incident zenith"
    return [
        *(("", block) for block in in_blocks(first, parameters, [status], width)),
        *intervals,
        *((title, block) for block in in_blocks(first, quality, [], width)),
    ]


def summary_rows(fit: Fit) -> list[tuple[str, str]]:
    """Return how a fit went, as (what, words)."""
    good, search, setup = np.isfinite(fit.objective), fit.search, fit.setup
    statuses = Counter(status_column(fit, np.arange(len(fit.status)))[1])
    counts = "; ".join(f"{count} {status}" for status, count in statuses.most_common())
    rows = [("status", counts), ("method", f"{setup.method}, seed {setup.seed}, weights {setup.weighting}")]
    if setup.gls:
        rows.append(("assumed", ASSUMES))
    rows += zip(("chosen search", "next better"), search_lines(search), strict=False)
    rows += [("" if k else "through", text) for k, text in enumerate(through_lines(fit))]
    held = fixed_words(fit)
    if held:
        rows.append(("fixed", held))
    rows += [("shared", text) for text in shared_words(fit)]
    if good.any():
        worst, middle = fit.objective[good].max(), np.median(fit.objective[good])
        rows += [
            ("E (13)", f"median {plain(middle, 4)}, worst {plain(worst, 4)}"),
            *goodness_rows(fit),
            ("σr (14)", f"median {plain(100 * np.median(fit.relative_rms[good]), 3)} % over all directions"),
            ("evaluations", f"{int(np.median(search.evaluations[good]))} at each wavelength (median)"),
            (
                "starts that agree",
                f"{int(np.median(search.agreeing[good]))} of {int(np.median(search.starts[good]))} (median)",
            ),
            ("condition", f"median {plain(np.median(fit.estimate.condition[good]), 3)}, columns scaled"),
        ]
    if np.isfinite(search.acceptance).any():
        rows.append(("moves taken", f"{100 * np.nanmedian(search.acceptance):.0f} %"))
    if search.not_finite.any():
        rows.append(("refused", f"{int(search.not_finite.sum())} evaluations that were not finite"))
    rows.append(("masked", f"{np.count_nonzero(fit.scan.mask)} of {fit.scan.brdf.size} values"))
    if setup.left_out:
        rows.append(("left out", f"{setup.left_out} directions, those of transmission"))
    rows.append(("device", search.device))
    if np.isfinite(search.seconds):
        each = 1e3 * search.seconds / max(1, int(good.sum()))
        rows.append(("time", f"{search.seconds:.2f} s, {each:.3g} ms a wavelength"))
    drawn = fit.monte_carlo
    if drawn is not None and np.isfinite(drawn.seconds):
        rows.append(("Monte Carlo", f"{drawn.draws} draws, {drawn.seconds:.1f} s of it"))
    return rows


def goodness_rows(fit: Fit) -> list[tuple[str, str]]:
    """Return whether the model describes the data, as far as their uncertainties can tell."""
    found, weighting = fit.goodness, fit.setup.weighting
    chi2 = found.chi2_reduced[np.isfinite(found.chi2_reduced)]
    if len(chi2):
        poor = int(fit.misfit.sum())
        words = f"median {plain(np.median(chi2), 3)}, worst {plain(chi2.max(), 3)}"
        if weighting != "sigma":
            words += ", with the uncertainties of the scan, which the weights do not use; see weights sigma"
        told = f"not described at {poor} of {len(chi2)} wavelengths" if poor else "described"
        return [("χ²/ν", words), ("data", f"{told}, within their uncertainties")]
    scatter = found.scatter[np.isfinite(found.scatter)]
    if not len(scatter):
        return []
    middle = np.median(scatter)
    size = {"relative": f"{plain(100 * middle, 3)} %", "none": f"{plain(middle, 3)} 1/sr"}.get(weighting)
    why = "the scan has no" if fit.scan.sigma is None else "not all values have"
    taken = f"{why} uncertainties, so that the scatter about the model is taken for them"
    return [("χ²/ν", f"not known: {taken}{f' (median {size})' if size else ''}")]


def fixed_words(fit: Fit) -> str:
    """Return what was not fitted, with its value where it is one for all wavelengths."""
    words = []
    for name in fit.given:
        values = fit.parameters[name][np.isfinite(fit.parameters[name])]
        if len(values) and fit.model.parameter(name).given != "wavelength":
            one = values.min() == values.max()
            words.append(f"{name} = {plain(float(values[0]), 5)}" if one else f"{name}, a spectrum")
    return ", ".join(words)


def shared_words(fit: Fit) -> list[str]:
    """Return what is one number for all wavelengths, with its error bar, a line each."""
    out = []
    for name in fit.shared:
        good = np.flatnonzero(np.isfinite(fit.parameters[name]))
        if len(good):
            value, sigma = float(fit.parameters[name][good[0]]), float(fit.sigma[name][good[0]])
            bar = f" ± {sigma:.2g}" if np.isfinite(sigma) else ""
            out.append(f"{name} = {plain(value, 5)}{bar}, one number for all wavelengths")
    return out


def has_given(fit: Fit) -> bool:
    """Whether an uncertainty is marked as given that another parameter stays at its limit."""
    held = fit.estimate.at_bound
    return bool((held.any(axis=1, keepdims=True) & ~held & np.isfinite(fit.estimate.sigma)).any())


def remark_rows(fit: Fit) -> list[tuple[str, str]]:
    """Return what has to be known beside the numbers, and where, the most frequent first."""
    rows = []
    for text, nm in gathered(fit.remarks, fit.wavelength):
        where = f"{nm[0]:g} nm" if len(nm) == 1 else f"{len(nm)} from {nm[0]:g} to {nm[-1]:g} nm"
        rows.append((text, "everywhere" if len(nm) == len(fit.wavelength) else where))
    return rows


def report(fit: Fit, width: int = 100) -> str:
    """Return a fit as text: its tables, how it went, and what has to be known beside the numbers."""
    parts = []
    for title, columns in tables(fit, np.arange(len(fit.wavelength)), width):
        widths = [max([len(name), *map(len, cells)]) for name, cells in columns]
        rows = [[name for name, _ in columns], *zip(*(cells for _, cells in columns), strict=True)]
        lines = ["  ".join(text.rjust(w) for text, w in zip(row, widths, strict=True)) for row in rows]
        parts.append("\n".join([title, *lines] if title else lines))
    if has_given(fit):
        more = (
            "the intervals above do not need that" if fit.intervals else "fit(profile=True) finds intervals"
        )
        parts.append(f"{GIVEN_WORDS}; {more}")
    parts.append("\n".join(f"{what:18} {words}" for what, words in summary_rows(fit)))
    remarks = [f"- {text} ({where})" for text, where in remark_rows(fit)]
    return "\n\n".join([*parts, *(["\n".join(remarks)] if remarks else [])]) + "\n"

"""What a report says in words: summary, warnings and provenance of a fit."""

from __future__ import annotations

import numpy as np

from clbrdf.fit.budget import budget_table, fitted_names, half_sigma, has_halves, mean_table
from clbrdf.fit.gls import ASSUMES
from clbrdf.fit.result import Fit
from clbrdf.fit.tables import goodness_rows
from clbrdf.fit.words import gathered, through_lines
from clbrdf.scan import Scan

Rows = list[tuple[str, str]]


NOTABLE_REFUSALS = 0.01
"""Share of refused evaluations that is worth a word: a few in the corners of the limits are not."""


NOTABLE_DEVIATION = 0.1
"""σr of (14) from which it is a warning."""


def summary_rows(fit: Fit) -> Rows:
    """Return what was fitted, how, and how well."""
    scan = fit.scan
    w = fit.wavelength
    good = fit.objective[np.isfinite(fit.objective)]
    sigma = 100.0 * fit.relative_rms[np.isfinite(fit.relative_rms)]
    angles = ", ".join(f"{a:g}" for a in scan.incident_angles)
    span = f"{w[0]:g} nm" if len(w) == 1 else f"{len(w)} from {w[0]:g} to {w[-1]:g} nm"
    columns = ("bands", ", ".join(scan.bands)) if scan.bands else ("wavelengths", span)
    rows = [
        ("sample", scan.sample or "not named"),
        ("instrument", scan.instrument or "not named"),
        ("directions", f"{len(scan.theta_i)}, incident zenith {angles}°"),
        columns,
        ("model", f"{fit.model.name}: {fit.model.title}; {fit.model.source}"),
        *(("through" if k == 0 else "", text) for k, text in enumerate(through_lines(fit))),
        ("method", f"{fit.setup.method}, seed {fit.setup.seed}, weights {fit.setup.weighting}"),
        ("device", fit.search.device),
    ]
    if good.size:
        rows.append(("E (13)", f"median {np.median(good):.4g}, from {good.min():.4g} to {good.max():.4g}"))
    rows += goodness_rows(fit)
    if sigma.size:
        rows.append(
            ("σr (14)", f"median {np.median(sigma):.3g} %, from {sigma.min():.3g} to {sigma.max():.3g} %")
        )
    return rows


def warning_lines(fit: Fit) -> list[str]:
    """Return what a reader has to know before trusting the numbers; empty if nothing."""
    lines = []
    for status in ("no data", "no weight", "not converged", "ambiguous", "at bound"):
        here = fit.wavelength[fit.status == status]
        if len(here):
            lines.append(f"{status} at {_listed(here)}: {MEANING[status]}")
    lines += [f"{remark}, at {_listed(nm)}" for remark, nm in gathered(fit.remarks, fit.wavelength)]
    sigma = fit.relative_rms[np.isfinite(fit.relative_rms)]
    if sigma.size and np.median(sigma) > NOTABLE_DEVIATION:
        lines.append(
            f"the model misses the data by {100.0 * np.median(sigma):.3g} % (σr of (14), median over the"
            " wavelengths); read its parameters with that in mind"
        )
    if fit.setup.gls:
        lines.append(ASSUMES)
    lines += _mask_lines(fit.scan)
    refused, spent = int(fit.search.not_finite.sum()), int(fit.search.evaluations.sum())
    if refused > NOTABLE_REFUSALS * spent:
        lines.append(f"{refused} of {spent} evaluations of the search were not finite and were refused")
    repeated = fit.scan.repeated_directions()
    if repeated:
        lines.append(f"{repeated} directions are repeats of earlier ones; all were fitted")
    return lines + _plane_lines(fit.scan)


def scan_warnings(scan: Scan) -> list[str]:
    """Return what a reader of a scan has to know; empty if nothing."""
    lines = _mask_lines(scan)
    if scan.sigma is None:
        lines.append("the scan has no uncertainties")
    return lines


def _mask_lines(scan: Scan) -> list[str]:
    lines = []
    for name, count in scan.flag_counts().items():
        share = 100.0 * count / scan.brdf.size
        lines.append(f"{count} values ({share:.3g} %) are masked as {name.replace('_', ' ')}")
    return lines


def _plane_lines(scan: Scan) -> list[str]:
    if len(scan) > 1 and np.isin(np.round(scan.phi, 6), (0.0, 180.0, 360.0)).all():
        return ["measured in the plane of incidence only: beside it the model is not held by any point"]
    return []


def budget_words(fit: Fit) -> tuple[list[str], list[list[float | str]]]:
    """Return names and rows of what makes the error bars: 1σ by component, median over wavelengths."""
    rows: list[list[float | str]] = [
        [name, *("–" if v != v else f"{v:.2g}" for v in values)] for name, values in budget_table(fit)
    ]
    return ["component", *fitted_names(fit)], rows


def mean_words(fit: Fit) -> tuple[list[str], list[list[float | str]]]:
    """Return names and rows of the means over wavelengths, with the correlations between them."""
    rows: list[list[float | str]] = [
        [r.parameter, f"{r.value:.4g}", *(f"{v:.2g}" for v in (r.sigma, r.random, r.common)), str(r.count)]
        for r in mean_table(fit)
    ]
    return ["parameter", "mean", "1σ", "random part", "common part", "wavelengths"], rows


def fit_table(fit: Fit) -> tuple[list[str], list[list[float | str]]]:
    """Return names and rows of the paper's Tables 1 and 2: every wavelength, σr in percent, with 1σ.

    With both parts of 1σ where errors have some, and the ends of intervals where the fit has them.
    """
    angles = fit.scan.incident_angles
    names = ["wavelength_nm"]
    columns = []
    halves = [half_sigma(fit, common) for common in (False, True)] if has_halves(fit) else []
    for j, name in enumerate(fit.model.names):
        named = [("", fit.parameters[name]), ("_sigma", fit.sigma[name])]
        named += [
            (end, half[:, j]) for end, half in zip(("_sigma_random", "_sigma_common"), halves, strict=False)
        ]
        if name in fit.intervals:
            named += zip(("_lower", "_upper"), fit.intervals[name].T, strict=True)
        names += [f"{name}{end}" for end, _ in named]
        columns += [values for _, values in named]
    names += ["E", *(f"sigma_r_{a:g}deg_percent" for a in angles), "status"]
    rows: list[list[float | str]] = []
    for k, wavelength in enumerate(fit.wavelength):
        row: list[float | str] = [float(wavelength), *(float(values[k]) for values in columns)]
        row.append(float(fit.objective[k]))
        row += [100.0 * float(v) for v in fit.goodness.relative_rms_by_incident_angle[:, k]]
        rows.append([*row, str(fit.status[k])])
    return names, rows


MEANING = {
    "no data": "every value is masked, there is no fit",
    "no weight": "no value has a weight, there is no fit",
    "not converged": "the polish ran out of iterations; use these parameters with care",
    "ambiguous": "other parameters fit as well; single parameters mean little there, the BRDF does",
    "at bound": "at least one parameter is at its limit; other error bars are given that it stays there",
}


def _listed(wavelengths: np.ndarray) -> str:
    """Name few wavelengths, count many."""
    if len(wavelengths) <= 8:
        return ", ".join(f"{w:g}" for w in wavelengths) + " nm"
    return f"{len(wavelengths)} wavelengths from {wavelengths[0]:g} to {wavelengths[-1]:g} nm"


def provenance_rows(fit: Fit) -> Rows:
    """Return who made the fit and the scan, in their own words."""
    rows = [(f"fit: {key}", value) for key, value in fit.provenance.items()]
    return rows + [(f"scan: {key}", value) for key, value in fit.scan.provenance.items()]

"""What a page holds of a scan or a fit, as a mapping that JSON takes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.budget import half_sigma, has_halves
from clbrdf.fit.result import Fit
from clbrdf.fit.words import remarks_line
from clbrdf.models import NEEDS_PHI, Model
from clbrdf.models.javascript import javascript_text
from clbrdf.objective import WEIGHTS, weight_matrix
from clbrdf.scan import Scan
from clbrdf.storage import hdf5
from clbrdf.viz.page.pack import packed, packed_angles
from clbrdf.viz.page.promises import Promises, promises_of
from clbrdf.viz.page.seen import seen_of
from clbrdf.viz.page.thin import LARGEST, Thinning, thinning
from clbrdf.viz.page.tint import colour_record
from clbrdf.viz.report_words import provenance_rows, scan_warnings, summary_rows, warning_lines
from clbrdf.viz.subject import Subject

Array = npt.NDArray[np.float64]
Json = dict[str, Any]

FIT_BYTES = 48
"""Of a parameter at a wavelength: its value, 1σ, the two parts of it, and the ends of an interval."""


@dataclass(frozen=True, eq=False)
class PageSubject:
    """A scan of reflection, perhaps with its fit, under a name; `said` tells what was left out."""

    name: str
    scan: Scan
    fit: Fit | None = None
    source: str = ""
    said: tuple[str, ...] = ()


def open_for_page(path: str | Path) -> PageSubject:
    """Read a scan or a fit file; several scans in one are named as in ``file.h5::name``.

    Raises
    ------
    InputError
        The file is missing, damaged, holds neither, or holds directions of transmission only.
    """
    with hdf5.open_file(path) as file:
        content = hdf5.content_of(file)
    fit = Fit.open(path) if content == "fit" else None
    whole = Scan.open(path) if fit is None else fit.scan
    scan = whole.reflection() if fit is None else whole
    beyond = len(whole) - len(scan)
    said = (
        (f"{beyond} of {len(whole)} directions are of transmission and not in this page",) if beyond else ()
    )
    return PageSubject(whole.sample or Path(path).stem, scan, fit, Path(path).name, said)


def computable(subject: PageSubject) -> PageSubject:
    """Return a subject as far as a page can compute it: without its fit where it cannot, and with the reason.

    Raises
    ------
    InputError
        A fit of transmission without any direction of reflection.
    """
    fit = subject.fit
    if fit is None:
        return subject
    why = ""
    if subject.scan.transmitted.any():
        why = "it holds transmission, and this page shows the reflecting side"
    else:
        try:
            javascript_text(fit.model.formula)
        except (KeyError, NotImplementedError) as error:
            why = f"its formula has {error}, for which a browser has no function"
    if not why:
        return subject
    said = f"the fit of {fit.model.name} is not computed here: {why}; there are still pictures of it"
    return replace(subject, scan=subject.scan.reflection(), fit=None, said=(*subject.said, said))


def subject_record(subject: PageSubject, budget: int = LARGEST) -> Json:
    """Return what a page holds of one subject.

    Parameters
    ----------
    subject : PageSubject
    budget : int
        Bytes of measured values.
    """
    scan, fit = subject.scan, subject.fit
    count = 0 if fit is None else len(fit.model.names)
    seen = seen_of(fit, budget)
    fixed = FIT_BYTES * count + 2 * count * count + 32
    taken, more = (0, 0) if seen is None else (seen.bytes, seen.more)
    thin = thinning(len(scan), len(scan.wavelength), budget - taken, fixed, more)
    part = scan.rows(thin.rows).columns(thin.columns)
    angles = part.directions
    start = Subject(subject.name, scan, fit)
    promises = promises_of(fit)
    record: Json = {
        "name": subject.name,
        "source": subject.source,
        "labels": list(part.labels),
        "nm": None if part.bands else part.wavelength.tolist(),
        "theta_i": packed_angles(angles.theta_i),
        "phi_i": packed_angles(angles.phi_i),
        "theta_r": packed_angles(angles.theta_r),
        "phi": packed_angles(angles.turn),
        "brdf": packed(part.brdf, thin.kind),
        "sigma": None if part.sigma is None else packed(part.sigma, thin.kind),
        "flags": packed(_first_flag(part), "u1"),
        "flag_names": list(part.flag_names),
        "start": {
            "column": int(np.searchsorted(thin.columns, _column(start))),
            "theta_i": start.default_incident(),
        },
        "words": [*subject.said, *thin.words],
        "warnings": _warnings(subject, promises),
        "summary": scan_summary(scan) if fit is None else summary_rows(fit),
        "provenance": (
            [(f"scan: {k}", v) for k, v in scan.provenance.items()] if fit is None else provenance_rows(fit)
        ),
        "promises": None if promises is None else promises.record(),
        "colour": colour_record(part),
        "fit": None if fit is None else fit_record(fit, thin),
        "seen": None if seen is None else seen.record(thin),
    }
    return record


def _column(subject: Subject) -> int:
    return subject.column(subject.default_wavelength())


def _first_flag(scan: Scan) -> npt.NDArray[np.uint8]:
    """Return 0 where a value is usable, else 1 + the place of the first reason for masking."""
    assert scan.flags is not None
    out = np.zeros(scan.flags.shape, np.uint8)
    for k in range(len(scan.flag_names)):
        out[(out == 0) & ((scan.flags >> np.uint32(k)) & np.uint32(1)).astype(bool)] = k + 1
    return out


def scan_summary(scan: Scan) -> list[tuple[str, str]]:
    """Return what was measured."""
    angles = ", ".join(f"{a:g}" for a in scan.incident_angles[:24])
    labels = scan.labels
    return [
        ("sample", scan.sample or "not named"),
        ("instrument", scan.instrument or "not named"),
        ("directions", f"{len(scan)}, incident zenith {angles}°"),
        ("bands" if scan.bands else "wavelengths", labels[0] if len(labels) == 1 else _span(scan)),
        ("model", "none: this is a scan that is not fitted"),
    ]


def _span(scan: Scan) -> str:
    return f"{len(scan.labels)} from {scan.labels[0]} to {scan.labels[-1]}"


def _warnings(subject: PageSubject, promises: Promises | None) -> list[str]:
    lines = scan_warnings(subject.scan)
    if subject.fit is not None:
        lines = warning_lines(subject.fit)
    return lines + (promises.warnings() if promises is not None else [])


def model_record(model: Model) -> Json:
    """Return a model's table; its functions are a script of their own."""
    rows = [
        {
            "name": p.name,
            "unit": "" if p.unit == "1" else p.unit,
            "meaning": p.meaning,
            "log": p.scale == "log",
            "floor": p.log_floor,
            "sign": p.sign,
            "bounds": list(p.bounds),
            "given": p.given,
        }
        for p in model.parameters
    ]
    return {
        "name": model.name,
        "title": model.title,
        "source": model.source,
        "parameters": rows,
        "features": len(model.formula.features),
        "needs_phi": bool(model.flags & NEEDS_PHI),
    }


def fit_record(fit: Fit, thin: Thinning) -> Json:
    """Return what a page holds of a fit, at the wavelengths that are kept."""
    columns = thin.columns
    upper = np.triu_indices(len(fit.model.names), 1)
    lines = [remarks_line(fit.remarks[k]) for k in columns]
    remarks = sorted(set(lines))
    weights = _named_weights(fit, fit.setup.weighting)
    values: Json = {
        "model": model_record(fit.model),
        "parameters": packed(fit.vector[columns]),
        "sigma": packed(np.stack([fit.sigma[n] for n in fit.model.names], axis=-1)[columns]),
        "sigma_random": packed(half_sigma(fit, False)[columns]) if has_halves(fit) else None,
        "sigma_common": packed(half_sigma(fit, True)[columns]) if has_halves(fit) else None,
        "interval": _interval(fit, columns),
        "correlation": packed(fit.correlation[columns][:, upper[0], upper[1]], "f4"),
        "E": packed(fit.objective[columns]),
        "sigma_r": packed(fit.relative_rms[columns]),
        "status": [str(fit.status[k]) for k in columns],
        "remarks": remarks,
        "remark": [remarks.index(line) for line in lines],
        "bounds": fit.setup.bounds.tolist() if fit.setup.bounds.ndim == 2 else None,
        "given": list(fit.given),
        "method": fit.setup.method,
        "weights": weights or "as kept",
        "weight_values": None,
        "thinned": len(thin.rows) < len(fit.scan),
    }
    if not weights:
        largest = np.maximum(fit.setup.weights.max(axis=0), 1e-300)
        values["weight_values"] = packed((fit.setup.weights / largest)[np.ix_(thin.rows, columns)], "f4")
    return values


def _interval(fit: Fit, columns: npt.NDArray[np.intp]) -> Json | None:
    """Return the ends (K, P, 2) of profile-likelihood intervals; None without them."""
    if not fit.intervals:
        return None
    return packed(np.stack([fit.intervals[name][columns] for name in fit.model.names], axis=1))


def _named_weights(fit: Fit, name: str) -> str:
    """Return the name of the weights, if they are what the name says, else ""."""
    for known in (name, *WEIGHTS):
        if known in WEIGHTS and not (known == "sigma" and fit.scan.sigma is None):
            made = weight_matrix(fit.scan, known)
            if np.allclose(made, fit.setup.weights, rtol=1e-9, atol=0.0):
                return known
    return ""


def with_distinct_names(subjects: list[PageSubject]) -> list[PageSubject]:
    """Return the subjects with the name of their file after names that occur twice."""
    names = [s.name for s in subjects]
    return [
        replace(s, name=f"{s.name} ({s.source or k + 1})") if names.count(s.name) > 1 else s
        for k, s in enumerate(subjects)
    ]

"""The numbers behind a picture of lobes, as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from clbrdf.storage.files import whole_text
from clbrdf.viz.lobes import reference_values
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.subject import drawing_limit

NAMES = (
    "shown",
    "wavelength_nm",
    "theta_i_deg",
    "phi_i_deg",
    "theta_r_deg",
    "phi_deg",
    "measured_per_sr",
    "sigma_per_sr",
    "model_per_sr",
    "subtracted_per_sr",
    "masked",
)
STEP_ZENITH, STEP_AZIMUTH = 1.0, 10.0
"""Degrees between the directions in which a model is told."""

Row = tuple[str | float, ...]


def value_rows(requests: Sequence[LobeRequest]) -> list[Row]:
    """Return what lobes show, in the order of NAMES: measured directions, then the model all over."""
    limit = drawing_limit([r.subject for r in requests], [r.theta_i for r in requests])
    return [row for request in requests for row in (*_measured(request), *_modelled(request, limit))]


def _measured(request: LobeRequest) -> Iterator[Row]:
    subject, column = request.subject, request.column
    scan, rows = subject.scan, subject.rows(request.theta_i)
    nothing = np.full(len(rows), np.nan)
    sigma = nothing if scan.sigma is None else scan.sigma[rows, column]
    model = nothing
    if subject.fit is not None and subject.parameters(column) is not None:
        model = subject.model_values(column, scan.directions[rows])
    minus = nothing
    if request.minus is not None:
        minus = reference_values(request.minus, subject, rows, column)
    for k, n in enumerate(rows):
        angles = (scan.theta_i[n], scan.phi_i[n], scan.theta_r[n], scan.phi[n])
        values = (scan.brdf[n, column], sigma[k], model[k], minus[k])
        yield (request.name, _column(request), *angles, *values, "masked" if scan.mask[n, column] else "")


def _modelled(request: LobeRequest, limit: float) -> Iterator[Row]:
    subject, column = request.subject, request.column
    if subject.fit is None or subject.parameters(column) is None or request.minus is not None:
        return
    theta_r, phi = (
        a.ravel()
        for a in np.meshgrid(
            np.arange(0.0, limit + 1e-9, STEP_ZENITH), np.arange(0.0, 360.0, STEP_AZIMUTH), indexing="ij"
        )
    )
    directions = subject.directions([request.theta_i], theta_r, phi)
    values = subject.model_values(column, directions)
    turn = subject.phi_i if subject.anisotropic else 0.0
    for t, p, f in zip(theta_r, phi, values, strict=True):
        yield (request.name, _column(request), request.theta_i, turn, t, p, np.nan, np.nan, f, np.nan, "")


def _column(request: LobeRequest) -> str | float:
    subject = request.subject
    return subject.label(request.column) if subject.scan.bands else float(subject.wavelength[request.column])


def save_values(requests: Sequence[LobeRequest], path: str | Path, overwrite: bool = False) -> int:
    """Write `value_rows` as CSV, whole or not at all; return the number of rows.

    Numbers are written in full: read back, they are the same.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or cannot be written.
    """
    rows = value_rows(requests)
    lines = [",".join(NAMES), *(",".join(_cell(value) for value in row) for row in rows)]
    whole_text(path, "\n".join(lines) + "\n", overwrite)
    return len(rows)


def _cell(value: str | float) -> str:
    if isinstance(value, str):
        quoted = value.replace('"', '""')
        return f'"{quoted}"' if any(c in value for c in ',"\n\r') else value
    return repr(float(value)) if np.isfinite(value) else ""

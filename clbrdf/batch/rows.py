"""The rows of a catalogue's index: one a scan and wavelength."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit import Fit


@dataclass(frozen=True, eq=False)
class Rows:
    """W rows as columns, and what tells them from those of another scan or another state of it.

    Attributes
    ----------
    columns : mapping of str to (W,) array
        In the order of the file.
    scan_sha256, fit_sha256 : str
        Of the scan's file and of the fit's.
    fit_bytes : int
        Size of the fit's file.
    """

    columns: Mapping[str, npt.NDArray[Any]]
    scan_sha256: str
    fit_sha256: str
    fit_bytes: int


def rows_of(
    stem: str,
    fit: Fit,
    milliseconds: npt.NDArray[np.float64],
    scan_sha256: str,
    fit_sha256: str,
    fit_bytes: int,
) -> Rows:
    """Return the rows of a fit, with the time (W,) that each wavelength took.

    A parameter ``ks`` has the columns ``ks`` and ``ks_sigma``, in the units of the model's table.
    """
    w = len(fit.wavelength)
    columns: dict[str, npt.NDArray[Any]] = {
        "scan": np.full(w, stem),
        "sample": np.full(w, fit.scan.sample),
        "column": np.array(fit.scan.labels),
        "wavelength_nm": np.asarray(fit.wavelength),
        "model": np.full(w, fit.model.name),
        "status": np.asarray(fit.status),
        "E": np.asarray(fit.objective),
        "relative_rms": np.asarray(fit.relative_rms),
    }
    for name in fit.model.names:
        columns[name] = np.asarray(fit.parameters[name])
        columns[f"{name}_sigma"] = np.asarray(fit.sigma[name])
    columns["milliseconds"] = np.asarray(milliseconds)
    columns["fit_file"] = np.full(w, f"{stem}.h5")
    columns["scan_sha256"] = np.full(w, scan_sha256)
    columns["fit_sha256"] = np.full(w, fit_sha256)
    return Rows(columns, scan_sha256, fit_sha256, fit_bytes)

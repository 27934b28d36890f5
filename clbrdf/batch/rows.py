"""The rows of a catalogue's index: one a scan and wavelength."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit import Fit
from clbrdf.storage.files import whole_file

if TYPE_CHECKING:
    import pyarrow as pa

ROWS = "rows"
"""Folder of the rows of single scans, in that of the catalogue."""

LAST = ("milliseconds", "fit_file", "scan_sha256", "fit_sha256")
"""Columns behind those of the parameters."""


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of one scan, and what tells them from those of another state of it.

    Attributes
    ----------
    columns : mapping of str to (W,) array or str
        In the order of the file; a text is the same in all rows.
    scan_sha256, fit_sha256 : str
        Of the scan's file and of the fit's.
    fit_bytes : int
        Size of the fit's file.
    """

    columns: Mapping[str, npt.NDArray[Any] | str]
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

    A parameter ``ks`` has the columns ``ks`` and ``ks_sigma``, and ``ks_lower`` and ``ks_upper``, the ends of
    its interval, where the fit has one; in the units of the model's table.
    """
    columns: dict[str, npt.NDArray[Any] | str] = {
        "scan": stem,
        "sample": fit.scan.sample,
        "column": np.array(fit.scan.labels),
        "wavelength_nm": np.asarray(fit.wavelength),
        "model": fit.model.name,
        "status": np.asarray(fit.status),
        "E": np.asarray(fit.objective),
        "relative_rms": np.asarray(fit.relative_rms),
    }
    for name in fit.model.names:
        columns[name] = np.asarray(fit.parameters[name])
        columns[f"{name}_sigma"] = np.asarray(fit.sigma[name])
        if name in fit.intervals:
            columns[f"{name}_lower"], columns[f"{name}_upper"] = np.asarray(fit.intervals[name]).T
    columns["milliseconds"] = np.asarray(milliseconds)
    columns["fit_file"] = f"{stem}.h5"
    columns["scan_sha256"], columns["fit_sha256"] = scan_sha256, fit_sha256
    return Rows(columns, scan_sha256, fit_sha256, fit_bytes)


def rows_path(folder: Path, stem: str) -> Path:
    """Return where the rows of a scan stand in a catalogue's folder."""
    return folder / ROWS / f"{stem}.parquet"


def write_rows(path: Path, rows: Rows, request: str) -> None:
    """Write rows, whole; `request` is the digest of the settings.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    import pyarrow.parquet as pq

    with whole_file(path, overwrite=True) as part:
        pq.write_table(_table(rows, request), part)


def _table(rows: Rows, request: str) -> pa.Table:
    """Return rows as an Arrow table; texts that repeat are dictionaries."""
    import pyarrow as pa

    count = max(len(values) for values in rows.columns.values() if not isinstance(values, str))
    columns = {}
    for name, values in rows.columns.items():
        if isinstance(values, str):
            places = pa.array(np.zeros(count, dtype=np.int32))
            columns[name] = pa.DictionaryArray.from_arrays(places, pa.array([values]))
        elif values.dtype.kind == "U":
            columns[name] = pa.array(values.tolist()).dictionary_encode()
        else:
            columns[name] = pa.array(values)
    told = {"scan_sha256": rows.scan_sha256, "fit_sha256": rows.fit_sha256}
    told |= {"fit_bytes": str(rows.fit_bytes), "request": request}
    return pa.table(columns).replace_schema_metadata(told)

"""A fit as a table of plain columns: for pandas, xarray, and CSV."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.words import remarks_line
from clbrdf.storage.files import whole_text

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    import xarray as xr

    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]


def fit_columns(fit: Fit) -> dict[str, npt.NDArray[Any]]:
    """Return one row a wavelength: parameters with 1σ and intervals, goodness, status, remarks in words."""
    bands = fit.scan.bands
    out: dict[str, npt.NDArray[Any]] = {
        "band" if bands else "wavelength_nm": np.array(bands) if bands else np.array(fit.wavelength)
    }
    for name in fit.model.names:
        out[name], out[f"{name}_sigma"] = fit.parameters[name], fit.sigma[name]
        if name in fit.intervals:
            out[f"{name}_lower"], out[f"{name}_upper"] = fit.intervals[name].T
    found = fit.goodness
    return out | {
        "E": found.objective,
        "sigma_r": found.relative_rms,
        "chi2_reduced": found.chi2_reduced,
        "degrees_of_freedom": found.degrees,
        "status": fit.status,
        "misfit": fit.misfit,
        "remarks": np.array([remarks_line(remarks) for remarks in fit.remarks]),
    }


def to_dataframe(fit: Fit) -> pd.DataFrame:
    """Return the columns as a table of pandas."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError("pandas is not installed; install clbrdf[table]") from None
    return pd.DataFrame(fit_columns(fit))


def to_xarray(fit: Fit) -> xr.Dataset:
    """Return parameters and values with the coordinates wavelength, direction and parameter."""
    names = list(fit.model.names)
    axis = "band" if fit.scan.bands else "wavelength"
    data = {
        "parameters": ((axis, "parameter"), np.array(fit.vector)),
        "parameter_sigma": ((axis, "parameter"), np.array(fit.estimate.sigma)),
        "correlation": ((axis, "parameter", "parameter_2"), np.array(fit.correlation)),
        "objective": ((axis,), np.array(fit.objective)),
        "chi2_reduced": ((axis,), np.array(fit.chi2_reduced)),
        "status": ((axis,), np.array(fit.status)),
        "fitted": (("direction", axis), fit.evaluate()),
        "residual": (("direction", axis), np.array(fit.residuals)),
    }
    scan = fit.scan.to_xarray()
    named = scan.assign(data).assign_coords(parameter=names, parameter_2=names)
    return named.assign_attrs(model=fit.model.name)


def write_csv(fit: Fit, path: str | Path, overwrite: bool = False) -> None:
    """Write the columns as CSV, numbers to their last digit; NaN and infinite values as such.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or it cannot be written.
    """
    table = fit_columns(fit)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*(values.tolist() for values in table.values()), strict=True):
        writer.writerow([repr(cell) if isinstance(cell, float) else cell for cell in row])
    whole_text(path, text.getvalue(), overwrite)

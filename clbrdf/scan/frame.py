"""A scan (`record.Scan`, which stands above) as a table of pandas, or as a dataset of xarray."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")


def to_dataframe(scan: Any) -> pd.DataFrame:
    """Return one row a value: the four angles, wavelength or band, brdf, sigma, masked."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError("pandas is not installed; install clbrdf[table]") from None
    n, w = scan.brdf.shape
    table: dict[str, npt.NDArray[Any]] = {name: np.repeat(getattr(scan, name), w) for name in ANGLES}
    if scan.bands:
        table["band"] = np.tile(np.array(scan.bands), n)
    else:
        table["wavelength"] = np.tile(scan.wavelength, n)
    table["brdf"] = scan.brdf.ravel()
    if scan.sigma is not None:
        table["sigma"] = scan.sigma.ravel()
    table["masked"] = scan.mask.ravel()
    return pd.DataFrame(table)


def to_xarray(scan: Any) -> xr.Dataset:
    """Return brdf, sigma and mask over direction and wavelength (or band), angles as coordinates."""
    try:
        import xarray as xr
    except ImportError:
        raise InputError("xarray is not installed; install clbrdf[table]") from None
    axis = "band" if scan.bands else "wavelength"
    data: dict[str, Any] = {"brdf": (("direction", axis), np.array(scan.brdf), {"units": "1/sr"})}
    if scan.sigma is not None:
        data["sigma"] = (("direction", axis), np.array(scan.sigma), {"units": "1/sr"})
    data["masked"] = (("direction", axis), np.array(scan.mask))
    places: dict[str, Any] = {
        name: (("direction",), np.array(getattr(scan, name)), {"units": "deg"}) for name in ANGLES
    }
    units: Mapping[str, str] = {} if scan.bands else {"units": "nm"}
    places[axis] = ((axis,), np.array(scan.bands) if scan.bands else np.array(scan.wavelength), dict(units))
    return xr.Dataset(data, coords=places, attrs={"sample": scan.sample, "instrument": scan.instrument})

"""Writing a scan as a table with wavelengths as columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.columns_write import SETTLED
from clbrdf.formats.software import VERSION
from clbrdf.scan import Scan


def write(scan: Scan, path: Path) -> None:
    """Write the directions and values of a scan; masked values are empty cells.

    Raises
    ------
    InputError
        Bands without wavelengths.
    """
    if scan.bands:
        raise InputError(
            f"wide tables hold wavelengths, and the scan has the bands {', '.join(scan.bands)};"
            " write columns, SSDD or RGL"
        )
    values = np.where(scan.mask, np.nan, scan.brdf)
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        stream.write(f"{SETTLED} {VERSION}: BRDF in 1/sr, phi_r - phi_i = 180 is forward\n")
        heading = ["theta_i_deg", "phi_i_deg", "theta_r_deg", "phi_r_deg"]
        stream.write(",".join(heading + [f"{float(nm)!r}nm" for nm in scan.wavelength]) + "\n")
        for n in range(len(scan)):
            angles = (scan.theta_i[n], scan.phi_i[n], scan.theta_r[n], scan.phi_r[n])
            words = [repr(float(angle)) for angle in angles]
            words += ["" if np.isnan(value) else repr(float(value)) for value in values[n]]
            stream.write(",".join(words) + "\n")

"""Writing a scan as BiRD JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.software import VERSION
from clbrdf.scan import Scan

WORDS = {"s": "s", "p": "p", "unpolarised": "unpolarized"}


def write(scan: Scan, path: Path) -> None:
    """Write the unmasked values of a scan, with their uncertainties and polarisations.

    Raises
    ------
    InputError
        Several bands without wavelengths.
    """
    if len(scan.bands) > 1:
        raise InputError(
            f"BiRD files hold wavelengths, and the scan has the bands {', '.join(scan.bands)};"
            " write columns, SSDD or RGL"
        )
    row, column = np.nonzero(~scan.mask)
    if len(row) == 0:
        raise InputError("every value is masked; there is nothing to write")

    def item(unit: str, values: Any) -> dict[str, Any]:
        return {"unit": unit, "values": list(values)}

    data: dict[str, Any] = {
        name: item("deg", getattr(scan, name)[row].tolist())
        for name in ("theta_i", "phi_i", "theta_r", "phi_r")
    }
    data["BRDF"] = item("1/sr", scan.brdf[row, column].tolist())
    if scan.sigma is not None:
        sigma = scan.sigma[row, column]
        data["uBRDF"] = item("1/sr", [None if np.isnan(value) else float(value) for value in sigma])
    if not scan.bands:
        data["wavelength_i"] = item("nm", scan.wavelength[column].tolist())
        data["wavelength_r"] = item("nm", scan.wavelength[column].tolist())
    for name, known in (("i", scan.source_polarisation), ("r", scan.detector_polarisation)):
        if known in WORDS:
            data[f"polarization_{name}"] = {**item("", [WORDS[known]] * len(row)), "notation": "sp"}
    metadata = {"name": scan.sample, "instrument": scan.instrument, "software": f"clbrdf {VERSION}"}
    text = json.dumps({"metadata": metadata, "data": data}, ensure_ascii=False, allow_nan=False, indent=1)
    path.write_text(text + "\n", encoding="utf-8")

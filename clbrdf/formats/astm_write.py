"""Writing a scan as ASTM E1392 text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clbrdf.formats.software import VERSION
from clbrdf.scan import Scan


def write(scan: Scan, path: Path) -> None:
    """Write directions in radians and values; masked values are nan."""
    values = np.where(scan.mask, np.nan, scan.brdf)
    names = [" ".join(band.split()).replace(",", ";") for band in scan.bands]
    names = names or [f"{float(nm)!r}nm" for nm in scan.wavelength]
    angles = np.deg2rad(np.stack([scan.theta_i, scan.phi_i, scan.theta_r, scan.phi_r], axis=1))
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        for key, text in (("LAB_NAME", scan.instrument), ("SAMPLE_NAME", scan.sample)):
            if text.strip():
                stream.write(f"{key} {' '.join(text.split())}\n")
        stream.write(f"SOFTWARE clbrdf {VERSION}\n")
        stream.write(f"NUM_POINTS {len(scan)}\n")
        stream.write(f"VARS theta_i,phi_i,theta_s,phi_s,{','.join(names)}\n\n")
        for row in np.hstack([angles, values]):
            stream.write(",".join(repr(float(value)) for value in row) + "\n")

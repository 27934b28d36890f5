"""A scan in a line, and as the rows of a table, for notebooks and the prompt."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clbrdf.records import span_words

if TYPE_CHECKING:
    from clbrdf.scan.record import Scan


def one_line(scan: Scan) -> str:
    """Return what a scan holds, in a line."""
    n, w = scan.brdf.shape
    columns = ", ".join(scan.bands) if scan.bands else span_words(scan.wavelength, "nm")
    kind = "bands" if scan.bands else "wavelength" + "s" * (w != 1)
    masked = int(scan.mask.sum())
    told = f", {masked} values masked" if masked else ""
    return f"<Scan of {scan.sample or 'a sample'}: {n} directions, {w} {kind} ({columns}){told}>"


def main_rows(scan: Scan) -> dict[str, str]:
    """Return what a scan holds, by name."""
    count = f"{len(scan.wavelength)}, {span_words(scan.wavelength, 'nm')}"
    return {
        "sample": scan.sample or "–",
        "instrument": scan.instrument or "–",
        "directions": str(len(scan)),
        "incident zeniths": span_words(scan.incident_angles, "°"),
        "view zeniths": span_words(scan.theta_r, "°"),
        "bands" if scan.bands else "wavelengths": ", ".join(scan.bands) if scan.bands else count,
        "uncertainties": "none" if scan.sigma is None else f"{np.isfinite(scan.sigma).sum()} values",
        "masked": f"{int(scan.mask.sum())} of {scan.brdf.size} values",
    }


def title_of(scan: Scan) -> str:
    """Return the title of an entry."""
    return f"BRDF of {scan.sample or 'a sample'}"

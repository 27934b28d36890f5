"""Writing a scan as columns: one row a value, all digits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from clbrdf.formats.software import VERSION
from clbrdf.scan import Scan
from clbrdf.scan.component import root_sum
from clbrdf.scan.flags import FLAGS

SETTLED = "# written by clbrdf"
"""A file that begins so is believed: its conventions were settled before it was written."""


def write(scan: Scan, path: Path) -> None:
    """Write every value of a scan, masked ones with their reasons."""
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        stream.write(f"{SETTLED} {VERSION}: phi_r - phi_i = 180 is forward, values without cosine\n")
        stream.writelines(_rows(scan))


def _rows(scan: Scan) -> Iterator[str]:
    assert scan.flags is not None
    names = ["sample", "band" if scan.bands else "wavelength_nm"]
    names += ["theta_i_deg", "phi_i_deg", "theta_r_deg", "phi_r_deg"]
    # Of components, what is random and what is not are kept apart; which is which is not.
    common = root_sum(scan.common_components, scan.brdf) if scan.common_components else None
    bars = scan.sigma if common is None else scan.random_sigma
    names += ["fr_per_sr", *(["fr_std_per_sr"] if bars is not None else [])]
    names += [*(["fr_std_common_per_sr"] if common is not None else []), "flag"]
    names += ["bandpass_nm"] * (scan.bandpass is not None)
    names += ["solid_angle_sr"] * (scan.solid_angle is not None)
    yield ",".join(names) + "\n"
    sample = cell(scan.sample)
    columns = [cell(band) for band in scan.bands] or [repr(float(nm)) for nm in scan.wavelength]
    missing = np.uint32(1 << FLAGS.index("not_measured"))
    for n in range(len(scan)):
        angles = ",".join(repr(float(a[n])) for a in (scan.theta_i, scan.phi_i, scan.theta_r, scan.phi_r))
        for w, column in enumerate(columns):
            value, bits = float(scan.brdf[n, w]), scan.flags[n, w]
            words = [sample, column, angles, "" if bits & missing else repr(value)]
            words += [_or_empty(some[n, w]) for some in (bars, common) if some is not None]
            words.append(";".join(name for k, name in enumerate(scan.flag_names) if bits >> np.uint32(k) & 1))
            if scan.bandpass is not None:
                words.append(_or_empty(scan.bandpass[w]))
            if scan.solid_angle is not None:
                words.append(_or_empty(scan.solid_angle[n]))
            yield ",".join(words) + "\n"


def cell(text: str) -> str:
    """Return a text as a cell: one line, in quotes where it has a comma or a quote."""
    plain = " ".join(text.split())
    return '"' + plain.replace('"', '""') + '"' if any(mark in plain for mark in ',"#') else plain


def _or_empty(value: float) -> str:
    return "" if np.isnan(value) else repr(float(value))

"""`clbrdf import`: a measured file into a scan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from clbrdf.cli.options import Output, Overwrite
from clbrdf.cli.provenance import made_by
from clbrdf.cli.summary import print_scan
from clbrdf.files import check_apart, check_output
from clbrdf.formats.columns import read_columns


def command(
    files: list[Path], /, *, output: Output, sample: str | None = None, overwrite: Overwrite = False
) -> None:
    """Read measured BRDF from CSV files into one scan file.

    Columns, in any order and case, units in the names: wavelength_nm, theta_i_deg, theta_r_deg, dphi_deg
    (180 is forward), fr_per_sr; optional fr_std_per_sr, sample, flag. Flagged, missing, zero, negative
    and non-finite values are kept, masked and counted.

    Parameters
    ----------
    files
        CSV files that together hold the scan
    sample
        which sample to take, where the files hold several
    """
    check_apart([output], files)
    target = check_output(output, overwrite)
    scan = read_columns(files, sample)
    scan = replace(scan, provenance=made_by("import", files, {"sample": sample}, scan.provenance))
    scan.save(target, overwrite)
    print_scan(str(target), scan)

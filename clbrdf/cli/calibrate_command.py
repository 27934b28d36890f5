"""`clbrdf calibrate`: raw counts to an absolute BRDF, again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from clbrdf.cli.console import number, print_table
from clbrdf.cli.options import Output, Overwrite
from clbrdf.errors import InputError
from clbrdf.rig.budget import load_budget
from clbrdf.rig.calibrate import calibrate, save_calibrated
from clbrdf.rig.planfile import WavelengthGrid
from clbrdf.rig.rawscan import RawScan, read_raw
from clbrdf.rig.rigfile import load_rig
from clbrdf.storage.files import check_output


def command(
    scan: Path,
    *,
    output: Output,
    rig: Path | None = None,
    wavelength: str | None = None,
    budget: Path | None = None,
    overwrite: Overwrite = False,
) -> None:
    """Calibrate the raw counts of a measured scan by equation (2) and write a new scan.

    Parameters
    ----------
    scan
        scan file of 'clbrdf measure'
    rig
        rig file with corrected solid angle or detector; the one it was measured with if not given
    wavelength
        start:stop:step in nm for the new grid
    budget
        budget file (TOML) for the uncertainties; the paper's budget if not given
    """
    target = check_output(output, overwrite)
    raw = read_raw(scan)
    if rig is not None:
        raw = replace(raw, rig=load_rig(rig))
    if wavelength is not None:
        raw = _with_grid(raw, wavelength)
    chosen = load_budget(budget)
    try:
        result = calibrate(raw, chosen)
    except InputError as error:
        raise InputError(f"{scan}: {error}") from error
    save_calibrated(target, raw, result, chosen, overwrite)
    assert result.sigma is not None
    relative = np.abs(result.sigma / np.where(result.mask, np.nan, result.brdf))
    rows = [
        ["directions", f"{len(result.theta_i)}"],
        ["wavelengths", f"{len(result.wavelength)}"],
        ["masked values", f"{int(result.mask.sum())}"],
        ["median uncertainty (%)", number(float(np.nanmedian(relative)) * 100.0, 3)],
    ]
    print_table(f"{target}: calibrated by (2)", ("quantity", "value"), rows)


def _with_grid(raw: RawScan, text: str) -> RawScan:
    try:
        start, stop, step = (float(word) for word in text.split(":"))
        grid = WavelengthGrid(start=start, stop=stop, step=step)
    except ValueError as error:
        raise InputError(
            f"--wavelength {text!r}: write start:stop:step in nm, rising, as in 380:760:5"
        ) from error
    return replace(raw, plan=raw.plan.model_copy(update={"wavelength": grid}))

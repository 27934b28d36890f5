"""Weights of directions from a file: g1(θi) g2(θr) of (13) as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.sheet import open_sheet
from clbrdf.formats.text import read_text
from clbrdf.geometry import wrap_azimuth
from clbrdf.scan import Scan

COLUMNS = ("theta_i_deg", "theta_r_deg", "dphi_deg", "weight")

ANGLE_TOLERANCE = 1e-6
"""Degrees; angles nearer than this are the same direction."""


def read_weights(path: Path, scan: Scan) -> npt.NDArray[np.float64]:
    """Return one weight for each direction of a scan, (N,), from a CSV file.

    The file has the columns theta_i_deg, theta_r_deg, dphi_deg and weight; directions it does not name
    get weight 0.

    Raises
    ------
    InputError
        File missing, column missing, text in a number, a direction given twice or not in the scan.
    """
    if not path.is_file():
        raise InputError(f"weights {str(path)!r}: neither none, relative or sigma, nor a file")
    sheet = open_sheet(path, read_text(path), _fits)
    places = {name.strip().casefold(): place for place, name in enumerate(sheet.names)}
    missing = [name for name in COLUMNS if name not in places]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; the columns are {', '.join(COLUMNS)}")
    out = np.zeros(len(scan.theta_i))
    given = np.zeros(len(out), dtype=bool)
    for block in sheet.blocks():
        columns = [sheet.numbers(block, places[name]) for name in COLUMNS]
        for line, theta_i, theta_r, phi, weight in zip(block.lines, *columns, strict=True):
            place = f"{path}, line {line}"
            if not 0.0 <= weight < np.inf:
                raise InputError(f"{place}: weight {weight:g}; weights are finite and not negative")
            if not np.isfinite([theta_i, theta_r, phi]).all():
                raise InputError(f"{place}: direction {theta_i:g}°, {theta_r:g}°, {phi:g}° is not finite")
            turn = np.abs(scan.phi - wrap_azimuth(phi))
            apart = np.max([np.abs(scan.theta_i - theta_i), np.abs(scan.theta_r - theta_r)], axis=0)
            same = (apart < ANGLE_TOLERANCE) & (np.minimum(turn, 360.0 - turn) < ANGLE_TOLERANCE)
            if not same.any():
                raise InputError(f"{place}: the scan has no direction {theta_i:g}°, {theta_r:g}°, {phi:g}°")
            if given[same].any():
                raise InputError(f"{place}: direction {theta_i:g}°, {theta_r:g}°, {phi:g}° is given twice")
            out[same], given[same] = weight, True
    return out


def _fits(cells: list[str]) -> bool:
    return set(COLUMNS) <= {cell.casefold() for cell in cells}

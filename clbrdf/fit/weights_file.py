"""Weights of directions from a file: g1(θi) g2(θr) of (13) as a table."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
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
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        raise InputError(f"{path}: cannot be read as text; give a CSV file") from None
    out = np.zeros(len(scan.theta_i))
    given = np.zeros(len(out), dtype=bool)
    with io.StringIO(text, newline="") as stream:
        reader = csv.DictReader(stream)
        names = {(name or "").strip().casefold(): name for name in reader.fieldnames or ()}
        missing = [name for name in COLUMNS if name not in names]
        if missing:
            raise InputError(f"{path}: no column {missing[0]}; the columns are {', '.join(COLUMNS)}")
        for row in reader:
            place = f"{path}, line {reader.line_num}"
            try:
                theta_i, theta_r, phi, weight = (float(row[names[name]] or "") for name in COLUMNS)
            except (TypeError, ValueError):
                raise InputError(f"{place}: a cell is missing or not a number") from None
            if not 0.0 <= weight < np.inf:
                raise InputError(f"{place}: weight {weight:g}; weights are finite and not negative")
            turn = np.abs(scan.phi - wrap_azimuth(np.array(phi)))
            apart = np.max([np.abs(scan.theta_i - theta_i), np.abs(scan.theta_r - theta_r)], axis=0)
            same = (apart < ANGLE_TOLERANCE) & (np.minimum(turn, 360.0 - turn) < ANGLE_TOLERANCE)
            if not same.any():
                raise InputError(f"{place}: the scan has no direction {theta_i:g}°, {theta_r:g}°, {phi:g}°")
            if given[same].any():
                raise InputError(f"{place}: direction {theta_i:g}°, {theta_r:g}°, {phi:g}° is given twice")
            out[same], given[same] = weight, True
    return out

"""Writing a scan as SSDD: on a grid of spherical coordinates, or of those about the specular direction."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.grid_of import SAME, FitGrid, grid_of
from clbrdf.formats.software import VERSION
from clbrdf.formats.vectors import from_specular, to_specular
from clbrdf.scan import Scan
from clbrdf.scan.flags import for_other_reasons

Array = npt.NDArray[np.float64]

MODELS = {("monochrome",): "monochrome", ("R", "G", "B"): "rgb", ("X", "Y", "Z"): "xyz"}
ON_HORIZON = 90.0 - 1e-6


def write(scan: Scan, path: Path) -> None:
    """Write a scan whose directions are a grid, as 32-bit floats: reflection and transmission apart.

    Raises
    ------
    InputError
        Bands that SSDD has no name for, masked values, or directions that are no grid.
    """
    if scan.bands and scan.bands not in MODELS:
        raise InputError(
            f"SSDD holds spectra, RGB and XYZ, and the scan has the bands {', '.join(scan.bands)}"
        )
    stream = BytesIO()
    stream.write(f"VERSION 0.3\nSOFTWARE clbrdf-{VERSION}\n".encode())
    beyond = scan.transmitted
    for kind, rows in (("brdf", ~beyond), ("btdf", beyond)):
        if rows.any():
            _block(stream, scan.rows(rows), kind)
    path.write_bytes(stream.getvalue())


def _block(stream: BytesIO, scan: Scan, kind: str) -> None:
    assert scan.flags is not None
    masked = int(for_other_reasons(scan.flags).sum())
    if masked:
        raise InputError(f"{masked} values are masked, and SSDD holds whole grids; fit a model and export it")
    theta_r = 180.0 - scan.theta_r if kind == "btdf" else scan.theta_r
    found = _spherical(scan, theta_r) or _specular(scan, theta_r)
    if found is None:
        raise InputError(
            f"the {len(scan)} directions are no grid of θi, φi, θr and φr; fit a model and export it,"
            " or write columns or BiRD"
        )
    name, grid, values = found
    lines = [f"DATA_TYPE {kind}", f"COLOR_MODEL {MODELS.get(scan.bands, 'spectrum')}"]
    if not scan.bands:
        lines.append(f"WAVELENGTH_LIST {_list(scan.wavelength)}")
    lines.append(f"PARAM_TYPE {name}_coordinate_system")
    theta_i, phi_i, polar, azimuth = grid.axes
    if name == "specular" and azimuth[-1] <= 180.0:
        lines.append("REDUCTION_TYPE bilateral_symmetry")
    for k, axis in enumerate((theta_i, phi_i, polar, azimuth)):
        if k != 1 or len(axis) > 1 or axis[0] != 0.0:
            lines.append(f"PARAM{k}_LIST {_list(axis)}")
    for key, text in (("NAME", scan.sample), ("DEVICE", scan.instrument)):
        if text.strip():
            lines.append(f"{key} {' '.join(text.split())}")
    stream.write("\n".join([*lines, "DATA binary", ""]).encode("utf-8"))
    # The first list runs fastest, a spectrum at a time.
    stream.write(np.ascontiguousarray(values.transpose(3, 2, 1, 0, 4), dtype="<f4").tobytes() + b"\n")


def _list(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _spherical(scan: Scan, theta_r: Array) -> tuple[str, FitGrid, Array] | None:
    try:
        grid = grid_of([scan.theta_i, scan.phi_i, theta_r, scan.phi_r])
    except InputError:
        return None
    row = grid.row
    _spread_pole(row, grid.axes[2] == 0.0)
    return ("spherical", grid, scan.brdf[row]) if (row >= 0).all() else None


def _specular(scan: Scan, theta_r: Array) -> tuple[str, FitGrid, Array] | None:
    azimuth, radial = to_specular(scan.theta_i, theta_r, scan.phi)
    azimuth = np.where(radial < 1e-9, 0.0, np.where(azimuth > 360.0 - SAME, 0.0, azimuth))
    try:
        grid = grid_of([scan.theta_i, scan.phi_i, np.where(radial < 1e-9, 0.0, radial), azimuth])
    except InputError:
        return None
    row = grid.row
    _spread_pole(row, grid.axes[2] == 0.0)
    cells = np.meshgrid(grid.axes[0], grid.axes[3], grid.axes[2], indexing="ij")
    zenith = from_specular(*cells)[0].transpose(0, 2, 1)[:, None]
    missing = (row < 0) & (zenith < ON_HORIZON)
    if missing.any():
        return None
    return "specular", grid, np.where((row >= 0)[..., None], scan.brdf[row], 0.0)


def _spread_pole(row: npt.NDArray[np.intp], pole: npt.NDArray[np.bool_]) -> None:
    """Let the one direction at a pole stand for all azimuths (last axis), axis 2 being polar."""
    for k in np.flatnonzero(pole):
        there = row[:, :, k, :]
        there[:] = np.where(there >= 0, there, there.max(axis=-1, keepdims=True))

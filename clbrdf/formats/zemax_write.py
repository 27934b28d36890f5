"""Writing a scan as Zemax BSDF text: a grid about the specular direction, one wavelength or X, Y, Z."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.formats.grid_of import SAME, FitGrid, grid_of
from clbrdf.formats.rings import ring_weights, turn_weights
from clbrdf.formats.software import VERSION
from clbrdf.formats.vectors import from_specular, to_specular
from clbrdf.scan import Scan
from clbrdf.scan.flags import for_other_reasons

Array = npt.NDArray[np.float64]

ON_HORIZON = 90.0 - 1e-6
NAMES = ("TristimulusX", "TristimulusY", "TristimulusZ")


def write(scan: Scan, path: Path) -> None:
    """Write a scan whose directions are a grid about the specular direction.

    Raises
    ------
    InputError
        Several wavelengths, both sides, masked values, or directions that are no such grid.
    """
    names: tuple[str, ...] = NAMES if scan.bands == ("X", "Y", "Z") else ("Monochrome",)
    if scan.brdf.shape[1] != len(names):
        raise InputError(
            f"a Zemax file holds one wavelength, or X, Y and Z, and the scan has"
            f" {scan.brdf.shape[1]}; choose one with {advice('scan.at(wavelength)', '--wavelength')}"
        )
    beyond = scan.transmitted
    if beyond.any() and not beyond.all():
        sides = advice("scan.reflection()", "--side reflection or transmission")
        raise InputError(f"a Zemax file holds one side; choose with {sides}")
    assert scan.flags is not None
    masked = int(for_other_reasons(scan.flags).sum())
    if masked:
        raise InputError(
            f"{masked} values are masked, and a Zemax file holds whole grids; fit a model and export it"
        )
    transmission = bool(beyond.all())
    theta_r = 180.0 - scan.theta_r if transmission else scan.theta_r
    grid, values = _gridded(scan, theta_r)
    _write_text(scan, path, grid, values, names, transmission)


def _gridded(scan: Scan, theta_r: Array) -> tuple[FitGrid, Array]:
    azimuth, radial = to_specular(scan.theta_i, theta_r, scan.phi)
    centre = radial < 1e-9
    azimuth = np.where(azimuth > 360.0 - SAME, 0.0, azimuth)
    try:
        grid = grid_of(
            [scan.phi_i, scan.theta_i, np.where(centre, 0.0, azimuth), np.where(centre, 0.0, radial)]
        )
    except InputError as error:
        raise InputError(f"{error} about the specular direction; fit a model and export it") from None
    row = grid.row
    for k in np.flatnonzero(grid.axes[3] == 0.0):
        there = row[:, :, :, k]
        there[:] = np.where(there >= 0, there, there.max(axis=-1, keepdims=True))
    cells = np.meshgrid(*grid.axes[1:], indexing="ij")
    above = from_specular(*cells)[0] < ON_HORIZON
    missing = int(np.count_nonzero((row < 0) & above))
    if missing:
        raise InputError(
            f"{missing} of {row.size} cells of the grid about the specular direction are not in the"
            " scan; fit a model and export it"
        )
    return grid, np.where((row >= 0)[..., None], scan.brdf[row], 0.0)


def _write_text(
    scan: Scan, path: Path, grid: FitGrid, values: Array, names: tuple[str, ...], transmission: bool
) -> None:
    rotations, incidences, azimuths, radials = grid.axes
    half = azimuths[0] >= 0.0 and azimuths[-1] <= 180.0 and len(azimuths) > 1
    symmetry = "Asymmetrical4D" if len(rotations) > 1 else "PlaneSymmetrical" if half else "Asymmetrical"
    lines = [f"# written by clbrdf {VERSION}"]
    if scan.sample.strip():
        lines.append(f"# Sample: {' '.join(scan.sample.split())}")
    if not scan.bands:
        lines.append(f"# Wavelength: {float(scan.wavelength[0])!r} nm")
    content = "XYZ" if len(names) == 3 else "Monochrome"
    lines += ["Source\tMeasured", f"Symmetry\t{symmetry}", f"SpectralContent\t{content}"]
    lines.append(f"ScatterType\t{'BTDF' if transmission else 'BRDF'}")
    keys = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
    for key, axis in zip(keys, grid.axes, strict=True):
        lines += [f"{key}\t{len(axis)}", "\t".join(repr(float(value)) for value in axis)]
    for w, name in enumerate(names):
        lines += ["", name, "DataBegin"]
        for r in range(len(rotations)):
            for i in range(len(incidences)):
                table = values[r, i, :, :, w]
                lines.append(f"TIS {_tis(float(incidences[i]), azimuths, radials, table):.6g}")
                lines += ["\t".join(repr(float(value)) for value in line) for line in table]
        lines.append("DataEnd")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _tis(theta_i: float, azimuths: Array, radials: Array, table: Array) -> float:
    """∫ f cosθr dΩ about the specular direction; values below the horizon are 0."""
    if len(radials) < 2:
        return 0.0
    zenith = from_specular(np.full(1, theta_i), *np.meshgrid(azimuths, radials, indexing="ij"))[0]
    cosine = np.clip(np.cos(np.deg2rad(zenith)), 0.0, None)
    rings = ring_weights(radials, cosine=False)
    return float(2.0 * np.pi * turn_weights(azimuths) @ (table * cosine) @ rings)

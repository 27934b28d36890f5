"""Writing a scan as MERL `.binary`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.formats.vectors import to_half_difference
from clbrdf.scan import Scan
from clbrdf.scan.flags import for_other_reasons

Array = npt.NDArray[np.float64]

N_THETA, N_PHI = 90, 180
SCALES = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)


def write(scan: Scan, path: Path) -> None:
    """Write a scan of R, G and B; a cell holds the mean of the values nearest to it, −1 where there are none.

    Raises
    ------
    InputError
        Other columns than R, G and B, transmission, or a sample that was turned.
    """
    if scan.bands != ("R", "G", "B"):
        there = ", ".join(scan.bands) or f"{len(scan.wavelength)} wavelengths"
        raise InputError(
            f"MERL files hold R, G and B, and the scan has {there};"
            f" {advice('give a scan of these three bands', 'write them with --rgb')}"
        )
    if scan.transmitted.any():
        side = advice("scan.reflection()", "--side reflection")
        raise InputError(f"MERL files hold reflection only; choose it with {side}")
    if len(scan.rotations()):
        one = advice("scan.sel(phi_i=...)", "--phi-i")
        raise InputError(
            f"the scan was measured at {len(scan.rotations())} incident azimuths, and MERL files hold"
            f" no anisotropy; choose one with {one}, or write SSDD or RGL"
        )
    half, difference, turn = to_half_difference(scan.theta_i, scan.theta_r, scan.phi)
    # Node k of θh stands at k²/90°.
    h = np.clip(np.round(np.sqrt(half * N_THETA)), 0, N_THETA - 1).astype(np.intp)
    d = np.clip(np.round(difference), 0, N_THETA - 1).astype(np.intp)
    p = np.round(turn).astype(np.intp) % N_PHI
    cell = p + N_PHI * (d + N_THETA * h)
    size = N_THETA * N_THETA * N_PHI
    assert scan.flags is not None
    unusable = for_other_reasons(scan.flags) | (scan.brdf < 0.0)
    with open(path, "wb") as stream:
        stream.write(np.array([N_THETA, N_THETA, N_PHI], "<i4").tobytes())
        for w, scale in enumerate(SCALES):
            good = ~unusable[:, w]
            total = np.bincount(cell[good], scan.brdf[good, w], size)
            count = np.bincount(cell[good], minlength=size)
            plane = np.full(size, -1.0)
            np.divide(total / scale, count, out=plane, where=count > 0)
            stream.write(plane.astype("<f8").tobytes())

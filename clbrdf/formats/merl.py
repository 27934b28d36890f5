"""MERL `.binary`: isotropic RGB in half and difference angles (Matusik et al. 2003).

Three 32-bit counts (θh, θd, φd), then fp64 planes R, G, B, φd fastest, to be scaled by 1/1500, 1.15/1500 and
1.66/1500; θh = i²/90°, θd = i°, φd = i° over half a turn; 1/sr without cosine; negative where not measured.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.merl_write import write
from clbrdf.formats.reading import Reading
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.vectors import from_half_difference
from clbrdf.geometry import Directions
from clbrdf.scan.flags import FLAGS

Array = npt.NDArray[np.float64]

SCALES = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
N_THETA = 90
HEADER = 12
BANDS = ("R", "G", "B")


def sniff(head: Head) -> int:
    """Return whether the file begins with counts of 90, 90 and 180 or 360."""
    return SURE if _azimuths(head.start) else NO


def _azimuths(head: bytes) -> int:
    """Return the count of φd, 0 where the header is another."""
    counts = np.frombuffer(head[:HEADER], "<i4").tolist() if len(head) >= HEADER else []
    return int(counts[2]) if counts[:2] == [N_THETA, N_THETA] and counts[2] in (180, 360) else 0


def _size(azimuths: int) -> int:
    return HEADER + 3 * 8 * N_THETA * N_THETA * azimuths


def read(path: Path) -> list[Reading]:
    """Read a MERL file; cells whose incident or view direction lies below the horizon are left out.

    Raises
    ------
    InputError
        Another header, or a file whose size does not fit it.
    """
    with open(path, "rb") as stream:
        n_phi = _azimuths(stream.read(HEADER))
        if not n_phi:
            raise InputError(f"{path}: does not begin with the counts 90, 90, 180 (or 360) of a MERL file")
        size = path.stat().st_size
        if size != _size(n_phi):
            raise InputError(f"{path}: has {size} bytes, and {_size(n_phi)} are needed; copy it again")
        return [_read(stream, n_phi)]


def half_angles() -> Array:
    """Return the 90 half angles θh, degrees."""
    return np.arange(N_THETA, dtype=np.float64) ** 2 / N_THETA


def slice_angles(theta_h: float, n_phi: int) -> tuple[Array, Array, Array]:
    """Return θi, θr and φ of the cells at one θh, each (90 × n_phi,), in the order of the file, degrees."""
    theta_d = np.repeat(np.arange(N_THETA, dtype=np.float64), n_phi)
    phi_d = np.tile(np.arange(n_phi) * (180.0 / n_phi), N_THETA)
    return from_half_difference(np.full(1, theta_h), theta_d, phi_d)


def node_directions() -> Directions:
    """Return the directions of all cells of half a turn that lie above the horizon."""
    parts = [slice_angles(theta_h, 180) for theta_h in half_angles()]
    theta_i, theta_r, phi = (np.concatenate([part[k] for part in parts]) for k in range(3))
    keep = above(theta_i, theta_r)
    return Directions.relative(theta_i[keep], theta_r[keep], phi[keep])


def above(theta_i: Array, theta_r: Array) -> npt.NDArray[np.bool_]:
    """Return where both directions lie above the horizon."""
    return np.asarray((theta_i < 90.0) & (theta_r < 90.0))


def _read(stream: BinaryIO, n_phi: int) -> Reading:
    """Read slice by slice, so that little more than the result is in memory at any time."""
    cells = N_THETA * n_phi
    kept = sum(int(above(*slice_angles(h, n_phi)[:2]).sum()) for h in half_angles())
    theta_i, theta_r, phi = np.empty((3, kept))
    values, flags = np.empty((kept, 3)), np.zeros((kept, 3), np.uint32)
    start = 0
    for k, theta_h in enumerate(half_angles()):
        i, r, turn = slice_angles(theta_h, n_phi)
        here = above(i, r)
        part = slice(start, start + int(here.sum()))
        theta_i[part], theta_r[part], phi[part] = i[here], r[here], turn[here]
        for plane, scale in enumerate(SCALES):
            stream.seek(HEADER + 8 * cells * (plane * N_THETA + k))
            values[part, plane] = np.frombuffer(stream.read(8 * cells), "<f8")[here] * scale
        start = part.stop
    missing = values < 0.0
    flags[missing] = 1 << FLAGS.index("not_measured")
    values[missing] = np.nan
    phi_i = np.zeros(kept)
    for array in (theta_i, phi_i, theta_r, phi, values, flags):
        array.flags.writeable = False
    total = N_THETA * cells
    return Reading(
        theta_i,
        phi_i,
        theta_r,
        phi,
        values,
        bands=BANDS,
        flags=flags,
        notes=(f"{total - kept} of {total} cells lie below the horizon and were left out",),
    )


FORMAT = Format(
    "merl", "MERL .binary, RGB, isotropic", (".binary",), sniff, read, write,
    "R, G and B of an isotropic reflection, in cells of about 1°",
)  # fmt: skip

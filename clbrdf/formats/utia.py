"""UTIA `.bin`: anisotropic RGB on a grid of 15° in zenith and 7.5° in azimuth (Filip and Vávra 2014).

fp64 planes R, G, B of 288 × 288 values: incident θ, φ by rows, view θ, φ by columns, φ fastest; no header.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head

ZENITHS = np.arange(6) * 15.0
AZIMUTHS = np.arange(48) * 7.5
SIDE = len(ZENITHS) * len(AZIMUTHS)
SIZE = 3 * 8 * SIDE * SIDE


def sniff(head: Head) -> int:
    """Return whether the size is that of a UTIA file, and the first values may be reflectances."""
    if head.size != SIZE:
        return NO
    first = np.frombuffer(head.start[:8000], "<f8")
    return SURE if np.isfinite(first).all() and (np.abs(first) < 1e6).all() else NO


def read(path: Path) -> list[Reading]:
    """Read a UTIA file.

    Raises
    ------
    InputError
        A file of another size.
    """
    size = path.stat().st_size
    if size != SIZE:
        raise InputError(f"{path}: has {size} bytes, and a UTIA file has {SIZE}; copy it again")
    planes = np.fromfile(path, "<f8").reshape(3, SIDE * SIDE)
    zenith, azimuth = (a.ravel() for a in np.meshgrid(ZENITHS, AZIMUTHS, indexing="ij"))
    return [
        Reading(
            np.repeat(zenith, SIDE),
            np.repeat(azimuth, SIDE),
            np.tile(zenith, SIDE),
            np.tile(azimuth, SIDE),
            np.ascontiguousarray(planes.T),
            bands=("R", "G", "B"),
            # The scale of the database's values is not documented with the file.
            stated=Stated(scale=None, sure=frozenset({"angle", "origin"})),
        )
    ]


FORMAT = Format("utia", "UTIA .bin, RGB, anisotropic", (".bin",), sniff, read)

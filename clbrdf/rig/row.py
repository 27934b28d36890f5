"""One row of a measurement, and the table of its columns."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

POINT, DARK, DIRECT, CHECK = range(4)
KINDS = ("point", "dark", "direct", "check")
"""What a row is: a point of the plan, a dark spectrum, the direct beam, a point measured again."""

SKIPPED, SATURATED = 1, 2
ROW_FLAGS = ("limit_switch", "saturated")
"""Bits of a row's flags."""

NO_ROW = -1


@dataclass(frozen=True, eq=False)
class Row:
    """What one exposure recorded.

    Attributes
    ----------
    kind : int
        Place in `KINDS`.
    point : int
        Place in the route; −1 for darks and the direct beam.
    time : str
        ISO 8601 with zone.
    axes : (3,) float64
        Rig angles read back, degrees.
    reference_power : float
        Mean of the readings before and after, W.
    integration_time : float
        s.
    dark, direct : int
        The rows (counted over all segments) that this one uses; −1 for none.
    flags : int
        Bits named by `ROW_FLAGS`.
    counts : (P,) uint16
        Raw.
    """

    kind: int
    point: int
    time: str
    axes: npt.NDArray[np.float64]
    reference_power: float
    integration_time: float
    dark: int
    direct: int
    flags: int
    counts: npt.NDArray[np.uint16]


class Column(NamedTuple):
    """One column of the table: name, type on disk, shape of one value, unit, meaning."""

    name: str
    dtype: str
    shape: tuple[int, ...]
    units: str
    meaning: str


def columns(pixels: int) -> tuple[Column, ...]:
    """Return the columns as they stand in the file."""
    return (
        Column("kind", "u1", (), "", "0 point, 1 dark, 2 direct beam, 3 check"),
        Column("point", "<i8", (), "", "place in the route"),
        Column("time", "S32", (), "", "ISO 8601 with zone"),
        Column("axes", "<f8", (3,), "deg", "lamp, turn, pitch, read back"),
        Column("reference_power", "<f8", (), "W", "reference detector"),
        Column("integration_time", "<f8", (), "s", "integration time"),
        Column("dark", "<i8", (), "", "row of the dark spectrum used"),
        Column("direct", "<i8", (), "", "row of the direct beam used"),
        Column("flags", "<u4", (), "", "bits: 1 skipped at a limit switch, 2 saturated"),
        Column("counts", "<u2", (pixels,), "counts", "raw spectrum"),
    )


def values_of(row: Row) -> list[npt.NDArray[np.generic]]:
    """Return a row's values in the order and type of the columns."""
    return [
        np.asarray(
            getattr(row, c.name).encode() if c.name == "time" else getattr(row, c.name), dtype=c.dtype
        ).reshape(c.shape)
        for c in columns(len(row.counts))
    ]


def checksum(values: list[npt.NDArray[np.generic]]) -> int:
    """CRC-32 over a row's values: tells a row torn by a power cut from a whole one."""
    crc = 0
    for value in values:
        crc = zlib.crc32(np.ascontiguousarray(value).tobytes(), crc)
    return crc

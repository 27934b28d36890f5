"""One row of a measurement, and the table of its columns."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clbrdf.storage import units
from clbrdf.storage.schema import Item

POINT, DARK, DIRECT, CHECK, RUNG, PANEL = range(6)
KINDS = ("point", "dark", "direct", "check", "rung", "panel")
"""What a row is: a point of the plan, a dark spectrum, the direct beam, a point measured again, a longer
integration time of a row that follows, the reference panel."""

REFERENCES = (DIRECT, PANEL)
"""Kinds of rows that give the incident power."""

SKIPPED, SATURATED, DISAGREE = 1, 2, 4
ROW_FLAGS = ("limit_switch", "saturated", "rungs_disagree")
"""Bits of a row's flags."""

NO_ROW = -1


def nowhere() -> npt.NDArray[np.float64]:
    """Return the nominal direction of a row that has none."""
    return np.full(4, np.nan)


@dataclass(frozen=True, eq=False)
class Row:
    """What one exposure recorded.

    Attributes
    ----------
    kind : int
        Place in `KINDS`.
    point : int
        Number of the point in its plan; −1 for darks and references.
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
    counts : (P,) uint32
        Raw, the sum of `scans` scans; a pixel at which one of them was saturated holds
        `scans` times full scale.
    nominal : (4,) float64
        θi, φi, θr, φr that were asked for, degrees; NaN where no direction was.
    scans : int
        Scans summed.
    temperature : float
        Of the detector, °C; NaN where the instrument does not tell.
    rung : int
        The row with the next longer integration time of the same exposure; −1 for none.
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
    counts: npt.NDArray[np.uint32]
    nominal: npt.NDArray[np.float64] = field(default_factory=nowhere)
    scans: int = 1
    temperature: float = float("nan")
    rung: int = NO_ROW


LATER = ("nominal", "scans", "temperature", "rung")
"""Columns that files of earlier versions lack."""


class RowField(NamedTuple):
    """One column of the table: name, type on disk, shape of one value, unit, meaning."""

    name: str
    dtype: str
    shape: tuple[int, ...]
    units: str
    meaning: str
    missing: float = 0.0
    """Value in files from before the column existed."""


def columns(pixels: int) -> tuple[RowField, ...]:
    """Return the columns as they stand in the file."""
    nan = float("nan")
    return (
        RowField("kind", "u1", (), "", "0 point, 1 dark, 2 direct beam, 3 check, 4 rung, 5 panel"),
        RowField("point", "<i8", (), "", "number in the plan"),
        RowField("time", "S32", (), "", "ISO 8601 with zone"),
        RowField("axes", "<f8", (3,), "deg", "lamp, turn, pitch, read back"),
        RowField("reference_power", "<f8", (), "W", "reference detector"),
        RowField("integration_time", "<f8", (), "s", "integration time of one scan"),
        RowField("dark", "<i8", (), "", "row of the dark spectrum used"),
        RowField("direct", "<i8", (), "", "row of the incident power used"),
        RowField("flags", "<u4", (), "", "bits: 1 skipped at a limit switch, 2 saturated, 4 rungs disagree"),
        RowField("counts", "<u4", (pixels,), "counts", "raw spectrum, sum of the scans"),
        RowField("nominal", "<f8", (4,), "deg", "theta_i, phi_i, theta_r, phi_r asked for", nan),
        RowField("scans", "<u4", (), "", "scans summed", 1.0),
        RowField("temperature", "<f8", (), "degC", "of the detector", nan),
        RowField("rung", "<i8", (), "", "row with the next longer integration time", -1.0),
    )


def row_items(all_required: bool) -> list[Item]:
    """Return what a file holds of each column, R rows of P pixels; an older one lacks the later columns."""
    kinds = {"f": "real", "u": "bits", "i": "whole", "S": "bytes"}
    out = []
    for column in columns(1):
        shape = ("P",) if column.name == "counts" else tuple(str(length) for length in column.shape)
        unit = units.same_as(column.units) if column.units else None
        required = all_required or column.name not in LATER
        out.append(Item(column.name, ("R", *shape), unit, kinds[np.dtype(column.dtype).kind], required))
    return out


def row_values(row: Row) -> list[npt.NDArray[np.generic]]:
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

"""Exports of gonio-photometers of the Reflet and RT-300S families: tables of azimuth × signed zenith.

Four layouts of one measurement: ``DataType: BRDF(RT-300S)`` and ``BRDF(Raywiz)`` (.jdv), ``Name / Comment``
(Reflet text), and ``OPTIS - Anisotropic BSDF surface file v1.0`` (.rtd). Several incidences follow each
other. Which half-plane is forward the files do not say.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.table import long_reading
from clbrdf.formats.text import numbers, read_text, take

Array = npt.NDArray[np.float64]

STARTS = (
    "datatype:\tbrdf(rt-300s)",
    "datatype:\tbrdf(raywiz)",
    "name / comment :",
    "optis - anisotropic bsdf surface file v1.0",
)
Block = tuple[str, float, Array, Array, Array]
"""Sample, incident zenith, azimuths (P,), signed zeniths (T,), values (P, T)."""


def sniff(head: Head) -> int:
    """Return whether the first line is that of one of the layouts."""
    first = re.sub(r"[ \t]+", "\t", head.lines[0]) if head.lines else ""
    return SURE if any(first.startswith(re.sub(r"[ \t]+", "\t", start)) for start in STARTS) else NO


def read(path: Path) -> list[Reading]:
    """Read an export: all its blocks make one reading a sample.

    Raises
    ------
    InputError
        Naming the line: a block without an incidence, a table of another size than its axes.
    """
    lines = read_text(path).split("\n")
    first = re.sub(r"[ \t]+", " ", lines[0].strip().casefold())
    starts = [
        k
        for k, line in enumerate(lines)
        if re.sub(r"[ \t]+", " ", line.strip().casefold())[:16] == first[:16]
    ]
    reader = _rt300s
    if "raywiz" in first:
        reader = _raywiz
    elif first.startswith("name"):
        reader = _reflet
    elif first.startswith("optis"):
        reader = _rtd
    keys, values = [], []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        _, theta_i, azimuth, zenith, table = reader(path, lines[start:end], start)
        if not 0.0 <= theta_i < 90.0 or np.abs(zenith).max() > 90.0:
            raise InputError(f"{path}, line {start + 1}: an incidence or zenith beyond 0° to 90°")
        phi, theta = (a.ravel() for a in np.meshgrid(azimuth, zenith, indexing="ij"))
        below = np.abs(theta) < 90.0
        n = int(below.sum())
        keys.append(np.stack([np.full(n, theta_i), np.zeros(n), theta[below], phi[below]], axis=1))
        values.append(table.ravel()[below])
    flat = np.concatenate(values)
    return [
        long_reading(
            path, np.concatenate(keys), flat, np.zeros(len(flat), np.intp), np.empty(0), ("monochrome",),
            Stated(forward=None, scale=None, sure=frozenset({"angle"})),
            sample=path.stem, notes=(f"{len(starts)} tables were joined",),
        )
    ]  # fmt: skip


def _keys(lines: list[str], mark: str) -> dict[str, str]:
    out: dict[str, str] = {}
    for line in lines:
        name, found, value = line.partition(mark)
        if found:
            out.setdefault(name.strip().casefold(), value.strip())
    return out


def _number(path: Path, text: str, what: str, line: int) -> float:
    try:
        return float(text.split()[0])
    except (IndexError, ValueError):
        raise InputError(f"{path}, line {line + 1}: no {what} in this block") from None


def _rows(path: Path, lines: list[str], start: int, count: int, width: int) -> Array:
    """Return `count` rows of `width` numbers, the first lines that are not blank."""
    filled = [(k, line) for k, line in enumerate(lines, start) if line.strip()][:count]
    take(path, filled, count, "rows of a table", f"line {start + 1}")
    rows = [
        take(path, numbers(path, line, k + 1), width, "values of a row", f"line {k + 1}")
        for k, line in filled
    ]
    return np.array(rows)


def _rt300s(path: Path, lines: list[str], start: int) -> Block:
    keys = _keys(lines, ":")
    mark = next((k for k, line in enumerate(lines) if line.strip().casefold() == "raw data"), None)
    if mark is None or mark + 1 >= len(lines):
        raise InputError(f"{path}, line {start + 1}: no 'Raw data' in this block")
    zenith = numbers(path, lines[mark + 1], start + mark + 2)
    body = [line for line in lines[mark + 2 :] if line.strip()]
    table = _rows(path, lines[mark + 2 :], start + mark + 2, max(len(body), 1), len(zenith) + 1)
    theta_i = _number(path, keys.get("incidence", ""), "Incidence", start)
    return keys.get("sampleid", ""), theta_i, table[:, 0], zenith, table[:, 1:]


def _raywiz(path: Path, lines: list[str], start: int) -> Block:
    keys = _keys(lines, ":")
    body = [(k, line) for k, line in enumerate(lines, start) if line.strip() and ":" not in line]
    if len(body) < 4:
        raise InputError(f"{path}, line {start + 1}: this block ends before its table")
    counts = numbers(path, body[0][1], body[0][0] + 1)
    axes = numbers(path, body[1][1], body[1][0] + 1)
    n_phi = int(counts[-1]) if len(counts) == 3 and 1 <= counts[-1] <= 10_000 else 0
    if n_phi == 0 or len(axes) < 4:
        raise InputError(
            f"{path}, line {body[0][0] + 1}: three counts and the limits of the axes should stand here"
        )
    theta_i = _number(path, body[2][1], "incidence", start)
    rows = [numbers(path, line, k + 1) for k, line in body[3:]]
    bad = next((k for k, row in enumerate(rows) if len(row) != n_phi), None)
    if bad is not None:
        raise InputError(
            f"{path}, line {body[3 + bad][0] + 1}: {len(rows[bad])} values, and {n_phi} are needed"
        )
    azimuth = np.linspace(axes[0], axes[1], n_phi)
    zenith = np.linspace(axes[2], axes[3], len(rows))
    return keys.get("sampleid", ""), theta_i, azimuth, zenith, np.array(rows).T


def _reflet(path: Path, lines: list[str], start: int) -> Block:
    keys = _keys(lines, "\t")
    place = next((k for k, line in enumerate(lines) if line.casefold().startswith("theta lighting")), None)
    if place is None:
        raise InputError(f"{path}, line {start + 1}: no 'Theta Lighting' in this block")
    limits = [
        _number(path, keys.get(f"phi measure {w} :", ""), f"Phi measure {w}", start)
        for w in ("beginning", "end", "step")
    ]
    steps = (limits[1] - limits[0]) / limits[2] if limits[2] else 0.0
    count = round(steps) + 1 if np.isfinite(steps) else 0
    if not 1 <= count <= 10_000:
        raise InputError(
            f"{path}, line {start + 1}: the azimuths from {limits[0]:g} to {limits[1]:g} are impossible"
        )
    body = [line for line in lines[place + 1 :] if line.strip()]
    table = _rows(path, lines[place + 1 :], start + place + 1, max(len(body), 1), count + 1)
    theta_i = _number(path, lines[place].partition("\t")[2], "Theta Lighting", start + place)
    azimuth = np.linspace(limits[0], limits[1], count)
    return keys.get("name / comment :", ""), theta_i, azimuth, table[:, 0], table[:, 1:].T


def _rtd(path: Path, lines: list[str], start: int) -> Block:
    keys = _keys(lines, ":")
    match = re.search(r"\d+(?:\.\d+)?\s*$", keys.get("sampleid", ""))
    place = next(
        (k for k, line in enumerate(lines) if line.strip().casefold() == "reflection spectrum"), None
    )
    if place is None or match is None:
        raise InputError(
            f"{path}, line {start + 1}: no incidence at the end of SampleID, or no spectrum, in this block"
        )
    count = _number(
        path, lines[place + 1] if place + 1 < len(lines) else "", "number of wavelengths", start + place
    )
    first = place + 2 + (int(count) if 0 <= count <= 10_000 else 0)
    while first < len(lines) and not lines[first].strip():
        first += 1
    if first >= len(lines):
        raise InputError(f"{path}, line {start + 1}: this block ends before its table")
    azimuth = numbers(path, lines[first], start + first + 1)
    rows = []
    for k in range(first + 1, len(lines)):
        if not lines[k].strip():
            break
        rows.append(
            take(
                path,
                numbers(path, lines[k], start + k + 1),
                len(azimuth) + 1,
                "values of a row",
                f"line {start + k + 1}",
            )
        )
    if not rows:
        raise InputError(f"{path}, line {start + first + 1}: no rows of values follow the azimuths")
    table = np.array(rows)
    return keys.get("sampleid", ""), float(match.group()), azimuth, table[:, 0], table[:, 1:].T


FORMAT = Format("gonio", "RT-300S and Reflet exports (.jdv, .rtd, text)", (".jdv",), sniff, read)

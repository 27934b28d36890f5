"""SSDD: surface scattering distribution data, natively spectral (K. Ryo, specification 0.2 and 0.3).

A header of ``VERSION``, then data blocks: keywords, lists of angles in degrees, and a table, as text or as
little-endian 32-bit floats, the first list fastest, a colour (or spectrum) at a time. 1/sr without cosine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.ssdd_write import write
from clbrdf.formats.text import LARGEST, check_file, increasing, numbers, shown
from clbrdf.formats.vectors import from_half_difference, from_specular

Array = npt.NDArray[np.float64]

BANDS = {"monochrome": ("monochrome",), "rgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z")}
TYPES = ("brdf", "btdf", "specular_reflectance", "specular_transmittance")
SPHERICAL, SPECULAR, HALF = (
    "spherical_coordinate_system",
    "specular_coordinate_system",
    "half_difference_coordinate_system",
)
LISTS = ("WAVELENGTH_LIST", *(f"PARAM{k}_LIST" for k in range(5)))
LONGEST_LINE = 1 << 22


@dataclass(frozen=True, eq=False)
class DataBlock:
    """One data block: keywords, lists, values (P3, P2, P1, P0, channels)."""

    words: Mapping[str, str]
    lists: Mapping[str, Array]
    values: Array


def sniff(head: Head) -> int:
    """Return whether the file begins with VERSION and has a DATA_TYPE."""
    start = head.start.lstrip()
    return SURE if start.startswith(b"VERSION") and b"DATA_TYPE" in head.start else NO


def read(path: Path) -> list[Reading]:
    """Read an SSDD file: BRDF and BTDF of one spectrum make one reading.

    Raises
    ------
    InputError
        A keyword missing or unknown, a table shorter than its lists ask for, words that are no numbers.
    """
    check_file(path, LARGEST)
    raw = path.read_bytes()
    blocks, left_out = _blocks(path, raw)
    readings = [_reading(path, block) for block in blocks]
    if not readings:
        raise InputError(f"{path}: holds {', '.join(left_out) or 'no data'}, and no BRDF or BTDF")
    if len(readings) == 2 and _same_columns(*readings):
        readings = [_both(*readings)]
    if left_out:
        note = f"{', '.join(left_out)}: left out, a scan holds BRDF and BTDF"
        readings[0] = _with_note(readings[0], note)
    return readings


def _blocks(path: Path, raw: bytes) -> tuple[list[DataBlock], list[str]]:
    position, blocks, left_out = 0, [], []
    words: dict[str, str] = {}
    lists: dict[str, Array] = {}
    while position < len(raw):
        end = raw.find(b"\n", position)
        end = len(raw) if end < 0 else end
        if end - position > LONGEST_LINE:
            raise InputError(
                f"{path}: byte {position}: a line of more than {LONGEST_LINE} bytes is no keyword"
            )
        try:
            line = raw[position:end].decode("utf-8").strip()
        except UnicodeDecodeError:
            raise InputError(f"{path}: byte {position}: no text, where a keyword should stand") from None
        position = end + 1
        key, _, rest = line.partition(" ")
        rest = rest.partition("# ")[0].strip()
        if not line or line.startswith("#"):
            continue
        if key == "DATA_TYPE":
            words, lists = {}, {}
        if key in LISTS:
            lists[key] = increasing_list(path, key, rest)
        elif key == "DATA":
            words[key] = rest
            block, position = _table(path, raw, position, words, lists)
            if block is None:
                left_out.append(words["DATA_TYPE"].replace("_", " "))
            else:
                blocks.append(block)
        elif key.isupper():
            words[key] = rest
        else:
            raise InputError(f"{path}: byte {end - len(line)}: {shown(key)}, where a keyword should stand")
    if "DATA_TYPE" in words and "DATA" not in words:
        raise InputError(f"{path}: a data block without DATA; the file is cut")
    return blocks, left_out


def increasing_list(path: Path, key: str, text: str) -> Array:
    """Return the numbers of a list; all but the offset angles increase."""
    values = numbers(path, text)
    if len(values) == 0:
        raise InputError(f"{path}: {key} is empty")
    if not np.isfinite(values).all():
        raise InputError(f"{path}: {key} has a value that is not finite")
    return values if key == "PARAM4_LIST" else increasing(path, values, key)


def _table(
    path: Path, raw: bytes, position: int, words: dict[str, str], lists: dict[str, Array]
) -> tuple[DataBlock | None, int]:
    kind, model = words.get("DATA_TYPE", ""), words.get("COLOR_MODEL", "")
    if kind not in TYPES:
        raise InputError(f"{path}: DATA_TYPE {shown(kind)}; known are {', '.join(TYPES)}")
    if model not in (*BANDS, "spectrum"):
        raise InputError(f"{path}: COLOR_MODEL {shown(model)}; known are {', '.join(BANDS)}, spectrum")
    if model == "spectrum" and "WAVELENGTH_LIST" not in lists:
        raise InputError(f"{path}: COLOR_MODEL spectrum needs a WAVELENGTH_LIST")
    channels = len(lists["WAVELENGTH_LIST"]) if model == "spectrum" else len(BANDS[model])
    needed = ("PARAM0_LIST", "PARAM2_LIST", "PARAM3_LIST") if kind in TYPES[:2] else ("PARAM0_LIST",)
    for name in needed:
        if name not in lists:
            raise InputError(f"{path}: {name} is missing")
    sizes = [len(lists.get(f"PARAM{k}_LIST", [0.0])) for k in (3, 2, 1, 0)]
    if kind not in TYPES[:2]:
        sizes = [1, 1, *sizes[2:]]
    count = channels * int(np.prod(sizes, dtype=object))
    if words["DATA"] == "binary":
        end = position + 4 * count
        if end > len(raw):
            raise InputError(
                f"{path}: the lists ask for {4 * count} bytes, and {len(raw) - position} follow DATA"
            )
        flat = np.frombuffer(raw[position:end], "<f4").astype(np.float64)
    elif words["DATA"] == "ascii":
        if 2 * count > len(raw) - position + 1:
            raise InputError(f"{path}: the lists ask for {count} values, more than the file can hold")
        flat, end = _ascii(path, raw, position, count)
    else:
        raise InputError(f"{path}: DATA {shown(words['DATA'])}; known are ascii, binary")
    if kind not in TYPES[:2]:
        return None, end
    return DataBlock(dict(words), dict(lists), flat.reshape(*sizes, channels)), end


def _ascii(path: Path, raw: bytes, position: int, count: int) -> tuple[Array, int]:
    """Return `count` numbers and where they end; they fill whole lines."""
    parts, have = [], 0
    while have < count:
        if position >= len(raw):
            raise InputError(
                f"{path}: the table has {have} values, and its lists ask for {count}; the file is cut"
            )
        end = raw.find(b"\n", position)
        end = len(raw) if end < 0 else end
        line = raw[position:end].decode("latin-1").partition("#")[0]
        if line.strip():
            parts.append(numbers(path, line, 1 + raw.count(b"\n", 0, position)))
            have += len(parts[-1])
        position = end + 1
    if have > count:
        raise InputError(f"{path}: a line of the table has more values than the lists ask for")
    return np.concatenate(parts), position


def _reading(path: Path, block: DataBlock) -> Reading:
    names = [f"PARAM{k}_LIST" for k in (3, 2, 1, 0)]
    axes = [block.lists.get(name, np.zeros(1)) for name in names]
    azimuth, polar, phi_i, theta = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    values = block.values.reshape(-1, block.values.shape[-1])
    transmission = block.words["DATA_TYPE"] == "btdf"
    system = block.words.get("PARAM_TYPE", "")
    if system == SPHERICAL:
        theta_i, theta_r, phi_r = theta, polar, azimuth
    elif system == SPECULAR:
        offsets = block.lists.get("PARAM4_LIST", np.zeros(len(axes[3])))
        if len(offsets) != len(axes[3]):
            raise InputError(
                f"{path}: PARAM4_LIST has {len(offsets)} offsets for {len(axes[3])} incident angles"
            )
        shift = np.broadcast_to(offsets, block.values.shape[:4]).ravel()
        theta_i = theta
        theta_r, phi = from_specular(theta + shift, azimuth, polar)
        phi_r = phi_i + phi
    elif system == HALF:
        theta_i, theta_r, phi = from_half_difference(theta, polar, azimuth)
        phi_r = phi_i + phi
    else:
        raise InputError(f"{path}: PARAM_TYPE {shown(system)}; known are {SPHERICAL}, {SPECULAR}, {HALF}")
    keep = (theta_i >= 0.0) & (theta_i < 90.0 - 1e-6) & (theta_r < 90.0 - 1e-6) & (theta_r >= 0.0)
    keep &= _first_of_each(axes, block.values)
    lost = int(np.count_nonzero(~keep))
    model = block.words["COLOR_MODEL"]
    return Reading(
        theta_i[keep],
        phi_i[keep],
        (180.0 - theta_r if transmission else theta_r)[keep],
        phi_r[keep],
        np.ascontiguousarray(values[keep]),
        block.lists["WAVELENGTH_LIST"] if model == "spectrum" else np.empty(0),
        () if model == "spectrum" else BANDS[model],
        Stated(sure=ALL),
        sample=block.words.get("NAME", ""),
        instrument=block.words.get("DEVICE", ""),
        notes=(f"{lost} cells beyond the horizon or repeating another were left out",) if lost else (),
        provenance={"made": block.words["SOURCE_TYPE"]} if "SOURCE_TYPE" in block.words else {},
    )


def _first_of_each(axes: list[Array], values: Array) -> npt.NDArray[np.bool_]:
    """Return True but where a whole turn repeats its first azimuth, or a pole the same value."""
    keep = np.ones(values.shape[:4], dtype=bool)
    if len(axes[0]) > 1 and axes[0][-1] - axes[0][0] == 360.0:
        keep[-1] = (values[-1] != values[0]).any(axis=-1)
    for k in np.flatnonzero(axes[1] == 0.0):
        keep[1:, k] &= (values[1:, k] != values[:1, k]).any(axis=-1)
    if len(axes[2]) > 1 and axes[2][-1] - axes[2][0] == 360.0:
        keep[:, :, -1] &= (values[:, :, -1] != values[:, :, 0]).any(axis=-1)
    return keep.ravel()


def _same_columns(one: Reading, two: Reading) -> bool:
    return one.bands == two.bands and np.array_equal(one.spectrum, two.spectrum)


def _both(one: Reading, two: Reading) -> Reading:
    pairs = [(getattr(one, n), getattr(two, n)) for n in ("theta_i", "phi_i", "theta_r", "phi_r", "values")]
    theta_i, phi_i, theta_r, phi_r, values = (np.concatenate(pair) for pair in pairs)
    return Reading(
        theta_i, phi_i, theta_r, phi_r, values, one.spectrum, one.bands, one.stated,
        sample=one.sample or two.sample, instrument=one.instrument or two.instrument,
        notes=tuple(dict.fromkeys(one.notes + two.notes)), provenance=one.provenance,
    )  # fmt: skip


def _with_note(reading: Reading, note: str) -> Reading:
    from dataclasses import replace

    return replace(reading, notes=(*reading.notes, note))


FORMAT = Format(
    "ssdd", "SSDD, spectrum, RGB or XYZ", (".ssdd",), sniff, read, write,
    "any spectrum or bands, both sides, on a grid of θi, φi, θr, φr",
)  # fmt: skip

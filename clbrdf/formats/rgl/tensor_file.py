r"""The container: named arrays of numbers, little-endian, one after the other.

    char[12] "tensor_file\0" | u8 1 | u8 0 | u32 number of fields
    for each field: u16 length, name | u16 dimensions | u8 type | u64 offset | u64 length of each dimension
    then the arrays in C order, each on a multiple of 8 bytes

Every size that a file claims is held against the size of the file before anything is made of it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.storage.files import whole_file

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
TYPES = {
    code: np.dtype(f"<{name}")
    for code, name in enumerate(["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"], start=1)
}
CODES = {kind: code for code, kind in TYPES.items()}
ALIGNMENT = 8
MOST_DIMENSIONS = 16

Fields = Mapping[str, npt.NDArray[Any]]


def is_tensor_file(start: bytes) -> bool:
    """Whether a file that starts with these bytes (12 or more) is a tensor file."""
    return start[: len(MAGIC)] == MAGIC


def read_tensor_file(path: str | Path) -> dict[str, npt.NDArray[Any]]:
    """Read all arrays of a tensor file, read-only.

    Raises
    ------
    InputError
        The file is missing, no tensor file, cut short, or claims sizes that it does not have.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if not is_tensor_file(content):
        raise InputError(f"{path}: is no tensor file: it does not start with 'tensor_file'")
    try:
        return _read(content)
    except (_DamageError, struct.error, UnicodeDecodeError) as error:
        what = str(error) if isinstance(error, _DamageError) else "its list of fields is cut short or garbled"
        raise InputError(f"{path}: {what}; fetch or export the file again") from error


class _DamageError(Exception):
    """What is wrong with a file, in words."""


def _read(content: bytes) -> dict[str, npt.NDArray[Any]]:
    place = len(MAGIC)
    *version, count = struct.unpack_from("<BBI", content, place)
    if tuple(version) != VERSION:
        raise _DamageError(f"is a tensor file of version {version[0]}.{version[1]}, and 1.0 is read")
    place += 6
    fields: dict[str, npt.NDArray[Any]] = {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", content, place)
        place += 2
        if place + length > len(content):
            raise _DamageError("ends within the name of a field")
        name = content[place : place + length].decode("utf-8")
        place += length
        dimensions, code, offset = struct.unpack_from("<HBQ", content, place)
        place += 11
        if code not in TYPES:
            raise _DamageError(f"field {name!r} has type {code}, and 1 to {len(TYPES)} are known")
        if dimensions > MOST_DIMENSIONS:
            raise _DamageError(f"field {name!r} claims {dimensions} dimensions")
        shape = struct.unpack_from(f"<{dimensions}Q", content, place)
        place += 8 * dimensions
        size = math.prod(shape)
        end = offset + size * TYPES[code].itemsize
        if end > len(content):
            raise _DamageError(f"field {name!r} claims bytes up to {end}, and the file has {len(content)}")
        if name in fields:
            raise _DamageError(f"field {name!r} is there twice")
        if 0 in shape and max(shape) > len(content):
            raise _DamageError(f"field {name!r} claims the shape {shape}")
        fields[name] = np.frombuffer(content, TYPES[code], size, offset).reshape(shape)
    return fields


def write_tensor_file(path: str | Path, fields: Fields, overwrite: bool = False) -> None:
    """Write arrays as a tensor file, whole or not at all; the same arrays make the same bytes.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or it cannot be written.
    ValueError
        An array of a type that a tensor file does not have.
    """
    arrays = {name: np.asarray(array, order="C") for name, array in fields.items()}
    heads = [(name.encode("utf-8"), array) for name, array in arrays.items()]
    place = len(MAGIC) + 6 + sum(13 + len(name) + 8 * array.ndim for name, array in heads)
    head = MAGIC + struct.pack("<BBI", *VERSION, len(heads))
    gaps = []
    for name, array in heads:
        kind = array.dtype.newbyteorder("<")
        if kind not in CODES:
            raise ValueError(f"field {name.decode()!r} is of type {array.dtype}")
        gap = -place % ALIGNMENT
        gaps.append(gap)
        place += gap
        head += struct.pack("<H", len(name)) + name
        head += struct.pack(f"<HBQ{array.ndim}Q", array.ndim, CODES[kind], place, *array.shape)
        place += array.nbytes
    with whole_file(path, overwrite) as part, open(part, "wb") as stream:
        stream.write(head)
        for gap, array in zip(gaps, arrays.values(), strict=True):
            stream.write(bytes(gap))
            stream.write(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())

"""A segment file as an image in memory that HDF5 reads without waiting for its writer.

HDF5 opens a file whose SWMR writer was killed in SWMR mode only, and then reads every block that looks
wrong a hundred times over, with pauses, in case the writer is about to complete it: damage costs minutes.
So the bytes are read as they are, the marks "open for writing" are taken out of the superblock, and what
is wrong is reported at once.

Source: HDF5 File Format Specification 3.0, "Disk Format: Level 0A - Format Signature and Superblock",
version 3, and its checksum, Bob Jenkins, lookup3.c, hashlittle().
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

SIGNATURE = b"\x89HDF\r\n\x1a\n"
VERSION_AT, FLAGS_AT, END_AT, CHECKSUM_AT = 8, 11, 28, 44
MOST_MISSING = 1 << 26
"""Bytes that a writer may have announced and not written yet."""

MASK = 0xFFFFFFFF


def image_of(path: Path) -> io.BytesIO:
    """Return a file's bytes with the consistency flags of its superblock cleared.

    Raises
    ------
    ValueError
        It does not begin with an intact superblock of version 3 (such as HDF5 writes for SWMR).
    OSError
        It cannot be read.
    """
    data = bytearray(path.read_bytes())
    if len(data) < CHECKSUM_AT + 4 or data[: len(SIGNATURE)] != SIGNATURE or data[VERSION_AT] != 3:
        raise ValueError("no superblock of version 3")
    (found,) = struct.unpack_from("<I", data, CHECKSUM_AT)
    if found != lookup3(bytes(data[:CHECKSUM_AT])):
        raise ValueError("the superblock does not match its checksum")
    (end,) = struct.unpack_from("<Q", data, END_AT)
    if end - len(data) > MOST_MISSING:
        raise ValueError(f"{len(data)} of {end} bytes are there")
    # A writer that was stopped may have announced space for a row that it never committed.
    data.extend(bytes(max(0, end - len(data))))
    data[FLAGS_AT] = 0
    struct.pack_into("<I", data, CHECKSUM_AT, lookup3(bytes(data[:CHECKSUM_AT])))
    return io.BytesIO(bytes(data))


def lookup3(key: bytes) -> int:
    """Return Bob Jenkins' 32-bit hash of bytes, started with 0; 11 operations for each 4 bytes."""
    a = b = c = (0xDEADBEEF + len(key)) & MASK
    if not key:
        return c
    last = (len(key) - 1) // 12 * 12
    for place in range(0, last, 12):
        x, y, z = struct.unpack_from("<III", key, place)
        a, b, c = _mix((a + x) & MASK, (b + y) & MASK, (c + z) & MASK)
    x, y, z = struct.unpack("<III", key[last:].ljust(12, b"\0"))
    return _final((a + x) & MASK, (b + y) & MASK, (c + z) & MASK)


def _rotate(x: int, by: int) -> int:
    return ((x << by) | (x >> (32 - by))) & MASK


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for by in (4, 6, 8, 16, 19, 4):
        a = ((a - c) & MASK) ^ _rotate(c, by)
        c = (c + b) & MASK
        a, b, c = b, c, a
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for by in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _rotate(b, by)) & MASK
        a, b, c = b, c, a
    return b

"""A seal at the end of our HDF5 files: whether their bytes are those that were written.

HDF5 keeps no checksum of a file, and can crash or run for ever on one that is damaged. Our files end, after
the last byte that HDF5 knows of, in a line with the CRC-32 of all before it. HDF5 passes over it; a program
that changes the file with HDF5 cuts it off or leaves it wrong, and the file is then looked at with care
(`sound.py`). It tells damage by accident, and is no signature.
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path

WORDS = b"\nclbrdf sealed crc32 "
LENGTH = len(WORDS) + 8 + 1
BLOCK = 1 << 22


def seal(path: Path) -> None:
    """Append the seal to a file that is complete."""
    with open(path, "r+b") as stream:
        size = stream.seek(0, os.SEEK_END)
        line = _line(_crc(path, size))
        stream.seek(size)
        stream.write(line)


def is_sealed(path: Path) -> bool:
    """Whether a file ends in a seal that fits its bytes."""
    with open(path, "rb") as stream:
        size = stream.seek(0, os.SEEK_END) - LENGTH
        if size <= 0:
            return False
        stream.seek(size)
        found = stream.read(LENGTH)
    return found.startswith(WORDS) and found == _line(_crc(path, size))


def _line(crc: int) -> bytes:
    return WORDS + f"{crc:08x}\n".encode("ascii")


def _crc(path: Path, size: int) -> int:
    crc = 0
    with open(path, "rb") as stream:
        while size > 0:
            block = stream.read(min(BLOCK, size))
            if not block:
                break
            crc, size = zlib.crc32(block, crc), size - len(block)
    return crc

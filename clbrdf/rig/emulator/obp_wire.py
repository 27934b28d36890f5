"""Ocean Binary Protocol as an instrument sees it, from the data sheet; shares nothing with our driver.

Little-endian: 44 bytes of header (C1 C0, version, flags, error, type, regarding, 6 reserved, checksum
type, length of the immediate data, 16 bytes of it, bytes remaining), payload, 16 bytes of checksum,
C5 C4 C3 C2. "Bytes remaining" counts what follows it: payload, checksum and footer.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from hashlib import md5

HEAD = 44
MD5_TYPE = 1
TYPE_AT, REGARDING_AT, IMMEDIATE_AT, REMAINING_AT = 8, 12, 24, 40


@dataclass(frozen=True)
class ObpRequest:
    """A request that passed the protocol's own checks; `data` immediate or payload."""

    kind: int
    regarding: int
    wants_ack: bool
    version: int
    checksum: int
    data: bytes


def cut_out(buffer: bytearray) -> bytes | None:
    """Remove the first whole frame from the buffer, and the bytes before it; None if there is none yet."""
    while True:
        start = buffer.find(b"\xc1\xc0")
        if start < 0:
            del buffer[: max(0, len(buffer) - 1)]
            return None
        del buffer[:start]
        if len(buffer) < HEAD:
            return None
        (remaining,) = struct.unpack_from("<I", buffer, REMAINING_AT)
        if not 20 <= remaining <= 4096:
            del buffer[:2]
            continue
        if len(buffer) < HEAD + remaining:
            return None
        frame = bytes(buffer[: HEAD + remaining])
        if frame.endswith(b"\xc5\xc4\xc3\xc2"):
            del buffer[: len(frame)]
            return frame
        del buffer[:2]


def read(frame: bytes) -> ObpRequest | None:
    """Return the request in a frame; None where its checksum is wrong."""
    version, flags = struct.unpack_from("<HH", frame, 2)
    kind, regarding = struct.unpack_from("<II", frame, TYPE_AT)
    checksum, length = frame[22], frame[23]
    if checksum == MD5_TYPE and md5(frame[:-20], usedforsecurity=False).digest() != frame[-20:-4]:
        return None
    if checksum > MD5_TYPE or version not in (0x1000, 0x1100) or length > 16:
        return None
    data = frame[IMMEDIATE_AT : IMMEDIATE_AT + length] if length else frame[HEAD:-20]
    return ObpRequest(kind, regarding, bool(flags & 4), version, checksum, data)


def write(to: ObpRequest, data: bytes, flags: int, error: int) -> bytes:
    """Return the frame that answers a request."""
    immediate, payload = (data, b"") if len(data) <= 16 else (b"", data)
    head = struct.pack("<2sHHHII6s", b"\xc1\xc0", to.version, flags, error, to.kind, to.regarding, b"")
    head += bytes([to.checksum, len(immediate)]) + immediate.ljust(16, b"\0")
    head += struct.pack("<I", len(payload) + 20)
    body = head + payload
    tail = md5(body, usedforsecurity=False).digest() if to.checksum == MD5_TYPE else bytes(16)
    return body + tail + b"\xc5\xc4\xc3\xc2"

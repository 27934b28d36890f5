"""OBP frames written from the table of the protocol (docs/protocols.md), without our codec."""

import hashlib
import struct


def frame(kind, regarding, data=b"", *, flags=0, error=0, version=0x1100):
    immediate = data if len(data) <= 16 else b""
    payload = b"" if len(data) <= 16 else data
    head = b"\xc1\xc0"
    head += struct.pack("<HHH", version, flags, error)
    head += struct.pack("<II", kind, regarding)
    head += bytes(6)
    head += bytes([1, len(immediate)]) + immediate.ljust(16, b"\0")
    head += struct.pack("<I", 20 + len(payload))
    assert len(head) == 44
    body = head + payload
    return body + hashlib.md5(body).digest() + bytes([0xC5, 0xC4, 0xC3, 0xC2])


def request(kind, regarding, data=b"", flags=0):
    return frame(kind, regarding, data, flags=flags)


def response(kind, regarding, data=b"", flags=1, error=0):
    return frame(kind, regarding, data, flags=flags, error=error)

"""Ocean Binary Protocol (OBP): one message to bytes and back.

Little-endian: a header of 44 bytes, the payload, 16 bytes of checksum, the footer C5 C4 C3 C2. The field
"bytes remaining" at offset 40 counts payload, checksum and footer. Up to 16 bytes of data travel inside
the header as immediate data.

Source: Ocean Optics, STS Data Sheet, "Ocean Binary Protocol".
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass

START = b"\xc1\xc0"
FOOTER = b"\xc5\xc4\xc3\xc2"
VERSIONS = (0x1000, 0x1100)
HEADER = struct.Struct("<2sHHHII6xBB16sI")
CHECKSUM_NONE, CHECKSUM_MD5 = 0, 1
TAIL = 20
"""Bytes of checksum and footer."""

MOST_REMAINING = 1 << 16
"""No message of ours is longer; a larger count is garbage."""

RESPONSE, ACK, ACK_REQUESTED, NACK, HARDWARE_EXCEPTION, DEPRECATED = 1, 2, 4, 8, 0x10, 0x20

RESET = 0x00000001
GET_HARDWARE_VERSION = 0x00000080
GET_FIRMWARE_VERSION = 0x00000090
GET_SERIAL_NUMBER = 0x00000100
GET_CORRECTED_SPECTRUM = 0x00101000
GET_RAW_SPECTRUM = 0x00101100
SET_INTEGRATION_TIME = 0x00110010
GET_TRIGGER_MODE = 0x00110100
SET_TRIGGER_MODE = 0x00110110
SET_LAMP_ENABLE = 0x00110410
GET_SCANS_TO_AVERAGE = 0x00120000
SET_SCANS_TO_AVERAGE = 0x00120010
GET_BOXCAR_WIDTH = 0x00121000
SET_BOXCAR_WIDTH = 0x00121010
GET_WAVELENGTH_COEFFICIENT_COUNT = 0x00180100
GET_WAVELENGTH_COEFFICIENT = 0x00180101
GET_NONLINEARITY_COEFFICIENT_COUNT = 0x00181100
GET_NONLINEARITY_COEFFICIENT = 0x00181101
GET_TEMPERATURE = 0x00400001

ERRORS = {
    0: "none",
    1: "protocol",
    2: "message type",
    3: "checksum",
    4: "message too large",
    5: "payload length",
    6: "data invalid",
    7: "not ready",
    8: "checksum type",
    9: "device reset",
    10: "bus",
    11: "out of memory",
    12: "no information",
    13: "internal",
    255: "deferred",
}
ERROR_TYPE, ERROR_RESET, ERROR_NO_INFORMATION = 2, 9, 12


@dataclass(frozen=True)
class Message:
    """One message; `data` travels in the header where it fits and `immediate` says so."""

    kind: int
    regarding: int = 0
    data: bytes = b""
    flags: int = 0
    error: int = 0
    version: int = 0x1100
    checksum: int = CHECKSUM_MD5

    def encode(self) -> bytes:
        """Return the bytes of the message; data of at most 16 bytes goes into the header."""
        immediate = self.data if len(self.data) <= 16 else b""
        payload = b"" if immediate else self.data
        body = (
            HEADER.pack(
                START,
                self.version,
                self.flags,
                self.error,
                self.kind,
                self.regarding,
                self.checksum,
                len(immediate),
                immediate,
                TAIL + len(payload),
            )
            + payload
        )
        digest = hashlib.md5(body, usedforsecurity=False).digest() if self.checksum else bytes(16)
        return body + digest + FOOTER


@dataclass(frozen=True)
class FoundFrame:
    """What stands at the start of a buffer.

    Attributes
    ----------
    message : Message or None
        The first whole message.
    used : int
        Bytes to remove from the buffer: garbage, broken messages and the message itself.
    garbage : bytes
        What was skipped, "" where nothing was.
    bad_checksum : Message or None
        A message skipped because its MD5 does not match; its fields are not to be trusted.
    """

    message: Message | None
    used: int
    garbage: bytes
    bad_checksum: Message | None = None


def find_message(buffer: bytes | bytearray) -> FoundFrame:
    """Look for the first whole, valid message: scan for C1 C0, check count, footer and MD5."""
    data = bytes(buffer)
    place, bad = 0, None
    while (start := data.find(START, place)) >= 0:
        if len(data) - start < HEADER.size:
            return FoundFrame(None, start, data[:start], bad)
        _, version, flags, error, kind, regarding, checksum, count, immediate, remaining = HEADER.unpack_from(
            data, start
        )
        end = start + HEADER.size + remaining
        sound = version in VERSIONS and TAIL <= remaining <= MOST_REMAINING and count <= 16 and checksum <= 1
        if sound and end > len(data):
            return FoundFrame(None, start, data[:start], bad)
        if sound and data[end - len(FOOTER) : end] == FOOTER:
            body = data[start : end - TAIL]
            payload = body[HEADER.size :]
            message = Message(
                kind, regarding, immediate[:count] if count else payload, flags, error, version, checksum
            )
            digest = data[end - TAIL : end - len(FOOTER)]
            if checksum == CHECKSUM_NONE or digest == hashlib.md5(body, usedforsecurity=False).digest():
                return FoundFrame(message, end, data[:start], bad)
            bad = message
        place = start + len(START)
    # A single C1 at the end may be the first half of a start.
    keep = 1 if data.endswith(START[:1]) else 0
    return FoundFrame(None, len(data) - keep, data[: len(data) - keep], bad)

"""Damaged files: a byte flipped, a part cut, doubled or moved, a number made absurd."""

from __future__ import annotations

import re

import numpy as np

ABSURD = (
    b"4294967295",
    b"-1",
    b"0",
    b"1e400",
    b"nan",
    b"99999999999999999999",
    b"1_000",
    b"0x10",
    b"",
    b"1,5",
)
WORDS = (b"\x00", b"\xff\xfe", b"{", b"}", b"\n", b"<", b'"', b",", b";", b"\t", b"#", b"DataEnd", b"\r")


def mutated(content: bytes, rng: np.random.Generator, most: int = 4) -> bytes:
    """Return content with one to `most` pieces of damage."""
    for _ in range(rng.integers(1, most + 1)):
        if not content:
            return content
        place = int(rng.integers(len(content)))
        # Headers are short and matter most.
        if rng.random() < 0.5:
            place = int(rng.integers(min(len(content), 600)))
        length = int(rng.integers(1, 1 + max(1, min(len(content) - place, 400))))
        kind = rng.integers(7)
        if kind == 0:
            content = content[:place] + bytes([int(rng.integers(256))]) + content[place + 1 :]
        elif kind == 1:
            content = content[:place]
        elif kind == 2:
            content = content[:place] + content[place + length :]
        elif kind == 3:
            content = content[: place + length] + content[place:]
        elif kind == 4:
            content = content[:place] + WORDS[rng.integers(len(WORDS))] + content[place:]
        elif kind == 5:
            numbers = list(re.finditer(rb"[-+]?\d+(?:\.\d+)?", content[: 1 << 16]))
            if numbers:
                found = numbers[int(rng.integers(len(numbers)))]
                content = (
                    content[: found.start()] + ABSURD[rng.integers(len(ABSURD))] + content[found.end() :]
                )
        else:
            bits = bytearray(content[place : place + 8])
            for k in range(len(bits)):
                bits[k] ^= int(rng.integers(256))
            content = content[:place] + bytes(bits) + content[place + 8 :]
    return content

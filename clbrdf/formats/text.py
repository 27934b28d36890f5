"""Text files: their encoding, their numbers, and where in them something is wrong."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Sized
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
S = TypeVar("S", bound=Sized)

LARGEST = 1 << 29
"""Bytes of a text file."""

BLOCK = 1 << 22
"""Characters whose numbers are read at once."""

MARKS = (
    *((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe\x00\x00", "utf-32"), (b"\x00\x00\xfe\xff", "utf-32")),
    *((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")),
)
"""Byte order marks, the longer ones first."""

UNMARKED = 0.8
"""Share of NUL bytes, at every second place, from which a text is UTF-16 that lost its mark."""

CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1a\x1c-\x1f]")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)


def check_file(path: Path, largest: int) -> int:
    """Return the size of a file, bytes; raise InputError where it is missing, no file, empty or large."""
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if not path.is_file():
        raise InputError(f"{path}: is no file; name a file")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path}: is empty; copy it again from its source")
    if size > largest:
        raise InputError(f"{path}: has {size} bytes, and at most {largest} are read; split it")
    return size


def read_text(path: Path) -> str:
    r"""Return the text of a file with lines that end in \n.

    UTF-8, UTF-16 and UTF-32 are known; what is none of them, and has no control characters, is
    taken for Windows-1252, in which instruments write ° and µ.

    Raises
    ------
    InputError
        No such file, an empty or a very large one, or no text.
    """
    check_file(path, LARGEST)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    return decoded(path, raw)


def decoded(path: Path, raw: bytes) -> str:
    r"""Return bytes as a text with lines that end in \n; see `read_text`."""
    encoding = wide_encoding(raw) or ("utf-8-sig" if raw.startswith(MARKS[0][0]) else "")
    if not encoding:
        control = CONTROL.search(raw)
        if control:
            raise InputError(
                f"{path}: not a text file (byte {control.start()} is {control.group()[0]}); a text is wanted"
            )
        encoding = "utf-8"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError as error:
        if encoding != "utf-8":
            raise InputError(f"{path}: not a text file (byte {error.start} is no {encoding})") from error
        text = raw.decode("cp1252", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def wide_encoding(raw: bytes) -> str:
    """Return the name of an encoding with two or four bytes a character, by its mark or its NULs; else ""."""
    marked = next((name for mark, name in MARKS if raw.startswith(mark)), "")
    if marked:
        return "" if marked == "utf-8-sig" else marked
    start = raw[:1024]
    pairs = len(start) // 2
    if pairs < 4 or start.count(0) < UNMARKED * pairs:
        return ""
    first, second = start[: 2 * pairs : 2].count(0), start[1 : 2 * pairs : 2].count(0)
    if second >= UNMARKED * pairs and first == 0:
        return "utf-16-le"
    return "utf-16-be" if first >= UNMARKED * pairs and second == 0 else ""


def numbers(path: Path, text: str, first_line: int = 1, separators: str = ",;") -> Array:
    """Return all numbers of a text in order; white space and `separators` stand between them.

    Raises
    ------
    InputError
        Naming the line of the first word that is no number.
    """
    out = array("d")
    start = line = 0
    while start < len(text):
        end = text.find("\n", start + BLOCK)
        end = len(text) if end < 0 else end + 1
        block = text[start:end]
        plain = block.translate({ord(mark): " " for mark in separators})
        try:
            if "_" in plain:
                raise ValueError
            out.extend(map(float, plain.split()))
        except ValueError:
            raise InputError(_bad_word(path, plain, block, first_line + line)) from None
        line += block.count("\n")
        start = end
    return np.frombuffer(out, dtype=np.float64) if out else np.empty(0)


def _bad_word(path: Path, plain: str, block: str, first_line: int) -> str:
    for number, (line, own) in enumerate(zip(plain.split("\n"), block.split("\n"), strict=True), first_line):
        for word in line.split():
            try:
                float(word)
                good = "_" not in word
            except ValueError:
                good = False
            if not good:
                return f"{path}, line {number}: {shown(word)} is not a number{comma_hint(own, word)}"
    return f"{path}: a word is not a number"


def shown(word: str) -> str:
    """Return a word in quotes, cut where it is long."""
    return repr(word if len(word) <= 24 else word[:21] + "...")


def comma_hint(line: str, word: str) -> str:
    """Return what to do where a number has a decimal comma, "" else."""
    del line
    return "; write decimal points, not commas" if re.fullmatch(r"[+-]?\d+,\d+", word) else ""


def take(path: Path, values: S, count: int, what: str, place: str = "") -> S:
    """Return the values; raise InputError where their number is not `count`."""
    if len(values) != count:
        where = f"{path}{', ' + place if place else ''}"
        raise InputError(f"{where}: {len(values)} {what}, and {count} are needed; the file is cut or damaged")
    return values


def count_of(path: Path, word: str, what: str, most: int, place: str = "") -> int:
    """Return a whole number of things, 1 to `most`.

    Raises
    ------
    InputError
        It is something else; a header that claims more is refused before anything is read.
    """
    try:
        number = int(word)
    except ValueError:
        number = 0
    if not 1 <= number <= most:
        where = f"{path}{', ' + place if place else ''}"
        raise InputError(f"{where}: {shown(word)} is no number of {what}; it is 1 to {most}")
    return number


def increasing(path: Path, values: Array, what: str) -> Array:
    """Return values that increase; raise InputError where they do not."""
    values = np.asarray(values, dtype=np.float64)
    bad = ~np.isfinite(values)
    bad[1:] |= np.diff(values) <= 0.0
    if bad.any():
        place = int(np.argmax(bad))
        raise InputError(f"{path}: {what} {place + 1} is {values[place]:g}; they have to increase")
    return values


class Lines:
    """The lines of a text in turn, with their numbers; blank ones and comments are left out."""

    def __init__(self, path: Path, text: str | Iterable[str], comment: str = "#") -> None:
        lines = text.split("\n") if isinstance(text, str) else list(text)
        self.path = path
        self._lines = [
            (number, line.strip())
            for number, line in enumerate(lines, 1)
            if line.strip() and not (comment and line.lstrip().startswith(comment))
        ]
        self._next = 0

    @property
    def number(self) -> int:
        """Number in the file of the line that was taken last; of the first one before that."""
        return self._lines[max(self._next - 1, 0)][0] if self._lines else 0

    def left(self) -> bool:
        """Whether there are lines left."""
        return self._next < len(self._lines)

    def peek(self) -> str:
        """Return the next line without taking it, "" at the end."""
        return self._lines[self._next][1] if self.left() else ""

    def take(self, what: str) -> str:
        """Take the next line; raise InputError where the file ends before it."""
        if not self.left():
            raise InputError(f"{self.path}: ends where {what} should stand; the file is cut")
        self._next += 1
        return self._lines[self._next - 1][1]

    def numbers(self, what: str, count: int | None = None) -> Array:
        """Take the next line as numbers, `count` of them where it is given.

        Raises
        ------
        InputError
            A word is no number, or there are more or fewer.
        """
        values = numbers(self.path, self.take(what), self.number)
        if count is not None:
            take(self.path, values, count, what, f"line {self.number}")
        return values

    def some_numbers(self, what: str, count: int) -> Array:
        """Take lines until they hold `count` numbers.

        Raises
        ------
        InputError
            A word is no number, the file ends, or a line holds more than are left.
        """
        parts: list[Array] = []
        have = 0
        while have < count:
            parts.append(self.numbers(what))
            have += len(parts[-1])
        if have > count:
            raise InputError(f"{self.path}, line {self.number}: more than {count} {what}")
        return np.concatenate(parts) if parts else np.empty(0)

    def rest(self) -> tuple[list[int], list[str]]:
        """Return the numbers and texts of all lines that are left."""
        left = self._lines[self._next :]
        self._next = len(self._lines)
        return [number for number, _ in left], [line for _, line in left]

"""The formats that are known, and which of them a file has."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path

from clbrdf.errors import InputError, advice
from clbrdf.formats.reading import Reading
from clbrdf.formats.text import CONTROL, check_file, wide_encoding
from clbrdf.scan import Scan

MODULES = (
    "rgl.format",
    "merl",
    "utia",
    "zemax",
    "astm",
    "speos",
    "fred",
    "lighttools",
    "ssdd",
    "bird",
    "openmaterial",
    "window",
    "pab",
    "gonio",
    "wide",
    "columns",
)
"""Modules of this package that define FORMAT, the particular ones before the general ones."""

HEAD = 1 << 16
"""Bytes that are looked at to tell a format."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""How files begin in which scans and fits are kept."""

SURE, LIKELY, NO = 2, 1, 0
"""What a sniff answers: a mark that only this format has; looks like it; something else."""

LARGEST = 1 << 32
"""Bytes of a file of any format."""


@dataclass(frozen=True)
class Head:
    """What is known of a file before it is read.

    Attributes
    ----------
    path : Path
    start : bytes
        At most HEAD of them.
    size : int
        Bytes of the file.
    """

    path: Path
    start: bytes
    size: int

    @cached_property
    def text(self) -> str:
        """The beginning as text in lower case, "" where it is binary."""
        wide = wide_encoding(self.start)
        if wide:
            return self.start.decode(wide, "replace").casefold()
        return "" if CONTROL.search(self.start) else self.start.decode("utf-8", "replace").casefold()

    @cached_property
    def lines(self) -> list[str]:
        """The first lines that are not blank, in lower case, without what surrounds them."""
        text = self.text.replace("\r\n", "\n").replace("\r", "\n").lstrip("\ufeff")
        return [line.strip() for line in text.split("\n") if line.strip()]


@dataclass(frozen=True)
class Format:
    """One kind of file.

    Attributes
    ----------
    name : str
        As `--format` takes it.
    title : str
        What it is, for tables.
    endings : tuple of str
        Of file names, with the dot, for writing.
    sniff : callable
        Head of a file -> SURE, LIKELY or NO.
    read : callable
        Path (and names of columns) -> what is in it, one reading a sample or side.
    write : callable or None
        Scan, path -> None; raises InputError where the format cannot hold the scan.
    holds : str
        For writers: what fits in, in words.
    maps_names : bool
        Whether `read` takes names for the headings of a table as its second argument.
    """

    name: str
    title: str
    endings: tuple[str, ...]
    sniff: Callable[[Head], int]
    read: Callable[..., Sequence[Reading]]
    write: Callable[[Scan, Path], None] | None = None
    holds: str = ""
    maps_names: bool = False


@cache
def formats() -> dict[str, Format]:
    """Return all formats by name."""
    found = [import_module(f"clbrdf.formats.{name}").FORMAT for name in MODULES]
    return {each.name: each for each in found}


def get_format(name: str) -> Format:
    """Return a format by name.

    Raises
    ------
    InputError
        There is none; the message lists those there are.
    """
    if name not in formats():
        raise InputError(f"no format is called {name!r}; there are {', '.join(formats())}")
    return formats()[name]


def find_format(path: Path) -> Format:
    """Return the format of a file, by its content.

    Raises
    ------
    InputError
        The file is missing or empty, or looks like no format or like several.
    """
    size = check_file(path, LARGEST)
    try:
        with open(path, "rb") as stream:
            head = stream.read(HEAD)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    about = Head(path, head, size)
    answers = {name: each.sniff(about) for name, each in formats().items()}
    best = max(answers.values())
    if best == NO:
        if head.startswith(HDF5):
            raise InputError(
                f"{path}: an HDF5 file; scans and fits of clbrdf need no import, and HDF5 files of others are"
                " not read"
            )
        control = CONTROL.search(head)
        if control:
            raise InputError(
                f"{path}: not a text file (byte {control.start()} is {control.group()[0]}), and of no known"
                f" binary format; name one with {_option()}"
            )
        raise InputError(
            f"{path}: the content is of no known format; name one with {_option()}"
            " ('clbrdf formats' lists them)"
        )
    found = [name for name, answer in answers.items() if answer == best]
    if best == SURE and len(found) > 1:
        raise InputError(f"{path}: may be {' or '.join(found)}; choose with {_option()}")
    return formats()[found[0]]


def format_for_writing(path: Path, name: str | None = None) -> Format:
    """Return the format to write a file in: the one named, or the first that has the file's ending.

    Raises
    ------
    InputError
        No format of that name, or none that writes such files.
    """
    writers = {each.name: each for each in formats().values() if each.write is not None}
    if name is not None:
        if get_format(name).write is None:
            raise InputError(f"{name} files are only read; written are {', '.join(writers)}")
        return writers[name]
    for each in writers.values():
        if path.name.casefold().endswith(each.endings):
            return each
    known = ", ".join(f"{each.name} ({each.endings[0]})" for each in writers.values())
    raise InputError(f"{path}: no format writes files of this ending; name one with {_option()}: {known}")


def _option() -> str:
    """Return what names a format."""
    return advice("format_name", "--format")

"""A table as text: which line heads it, what separates its cells, and its columns block by block."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.text import comma_hint, shown

Array = npt.NDArray[np.float64]

SEARCHED = 200
"""Lines in which the heading is looked for: instruments write some text above it."""

BLOCK_LINES = 20_000


@dataclass(frozen=True)
class Block:
    """Some rows: the number of each line, and its cells column by column."""

    lines: list[int]
    cells: list[tuple[str, ...]]


@dataclass(frozen=True)
class Sheet:
    """A table with a heading.

    Attributes
    ----------
    path : Path
    names : tuple of str
        Cells of the heading.
    separator : str
        "" for white space.
    above : str
        What stands above the heading.
    rows : list of (int, str)
        Numbers and texts of the lines of the table.
    """

    path: Path
    names: tuple[str, ...]
    separator: str
    above: str
    rows: list[tuple[int, str]]

    def blocks(self) -> Iterator[Block]:
        """Give the rows block by block.

        Raises
        ------
        InputError
            Naming the line: more or fewer cells than the heading names.
        """
        width = len(self.names)
        for first in range(0, len(self.rows), BLOCK_LINES):
            part = self.rows[first : first + BLOCK_LINES]
            cells = list(
                split(line for _, line in part) if not self.separator else _csv(part, self.separator)
            )
            if len(cells) != len(part):
                raise InputError(f"{self.path}, line {part[0][0]} or below: a quote that does not close")
            for (number, _), row in zip(part, cells, strict=True):
                if len(row) != width:
                    raise InputError(
                        f"{self.path}, line {number}: {len(row)} cells,"
                        f" and the first line names {width} columns"
                    )
            yield Block([number for number, _ in part], list(zip(*cells, strict=True)))

    def numbers(self, block: Block, place: int, empty: bool = False) -> Array:
        """Return a column of a block as numbers; an empty cell is NaN where `empty` allows it.

        Raises
        ------
        InputError
            Naming line and column of the first cell that is no number.
        """
        cells = block.cells[place]
        try:
            return np.array(list(map(float, cells)), dtype=np.float64)
        except ValueError:
            return np.array(
                [
                    self._number(line, place, cell.strip(), empty)
                    for line, cell in zip(block.lines, cells, strict=True)
                ]
            )

    def _number(self, line: int, place: int, cell: str, empty: bool) -> float:
        if not cell and empty:
            return float("nan")
        try:
            return float(cell)
        except ValueError:
            said = f"{shown(cell)} is not a number{comma_hint(cell, cell)}"
            raise InputError(
                f"{self.path}, line {line}, column {self.names[place].strip()}: {said}"
            ) from None


def split(lines: Iterator[str]) -> Iterator[list[str]]:
    """Give the words of each line."""
    return (line.split() for line in lines)


def _csv(part: list[tuple[int, str]], separator: str) -> Iterator[list[str]]:
    reader = csv.reader((line for _, line in part), delimiter=separator)
    try:
        yield from reader
    except csv.Error as error:
        raise InputError(f"line {part[0][0]} or below: {error}") from None


def find_heading(lines: list[str], fits: Callable[[list[str]], bool]) -> tuple[int, str] | None:
    """Return the place of the first line whose cells fit, and its separator."""
    for place, line in enumerate(lines[:SEARCHED]):
        for separator in ("\t", ";", ",", ""):
            if separator and separator not in line:
                continue
            cells = line.split(separator) if separator else line.split()
            if fits([cell.strip().strip('"') for cell in cells]):
                return place, separator
    return None


def open_sheet(path: Path, text: str, fits: Callable[[list[str]], bool]) -> Sheet:
    """Return the table of a text; without a line that fits, the first line of content heads it.

    Lines that begin with # and blank ones are left out.

    Raises
    ------
    InputError
        No heading, or nothing below it.
    """
    content = [
        (number, line)
        for number, line in enumerate(text.split("\n"), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    found = find_heading([line for _, line in content], fits)
    if found is None:
        first = content[0][1] if content else ""
        found = 0, max(",;\t", key=first.count)
    place, separator = found
    if len(content) < place + 2:
        raise InputError(f"{path}: no data; the first line names the columns, the next ones hold values")
    heading = content[place][1]
    cells = next(csv.reader([heading], delimiter=separator)) if separator else heading.split()
    above = "\n".join(line for _, line in content[:place])
    return Sheet(path, tuple(cell.strip() for cell in cells), separator, above, content[place + 1 :])

"""A table as text: which line heads it, what separates its cells, and its columns block by block."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice, shortened
from clbrdf.formats.text import comma_hint, shown

Array = npt.NDArray[np.float64]

SEARCHED = 200
"""Lines in which the heading is looked for: instruments write some text above it."""

BLOCK_LINES = 20_000

MOST_CELL = csv.field_size_limit()
"""Characters of a cell."""

COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eE][+-]?\d+)?\s*")
"""A number with a decimal comma."""


@dataclass(frozen=True)
class TextBlock:
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

    def blocks(self) -> Iterator[TextBlock]:
        """Give the rows block by block.

        Raises
        ------
        InputError
            Naming the line: more or fewer cells than the heading names.
        """
        width = len(self.names)
        for first in range(0, len(self.rows), BLOCK_LINES):
            part = self.rows[first : first + BLOCK_LINES]
            cells = [line.split() for _, line in part] if not self.separator else self._csv(part)
            for (number, _), row in zip(part, cells, strict=True):
                if len(row) != width:
                    raise InputError(
                        f"{self.path}, line {number}: {len(row)} cells,"
                        f" and the first line names {width} columns{self._hint(row)}"
                    )
            yield TextBlock([number for number, _ in part], list(zip(*cells, strict=True)))

    def numbers(self, block: TextBlock, place: int, empty: bool = False) -> Array:
        """Return a column of a block as numbers; an empty cell is NaN where `empty` allows it.

        Where the comma does not separate cells, it may stand for the decimal point.

        Raises
        ------
        InputError
            Naming line and column of the first cell that is no number.
        """
        cells = block.cells[place]
        try:
            return np.array(list(map(float, cells)), dtype=np.float64)
        except ValueError:
            if self.separator != "," and any(COMMA.fullmatch(cell) for cell in cells):
                return self._commas(block, place, empty)
            return np.array(
                [
                    self._number(line, place, cell.strip(), empty)
                    for line, cell in zip(block.lines, cells, strict=True)
                ]
            )

    def _commas(self, block: TextBlock, place: int, empty: bool) -> Array:
        """Return a column whose numbers have decimal commas; points beside them leave open which is which."""
        cells = block.cells[place]
        for line, cell in zip(block.lines, cells, strict=True):
            if "." in cell:
                raise InputError(
                    f"{self._place(line, place)}: {shown(cell.strip())} has a point, and other numbers of the"
                    " column have a comma; write decimal points in all of them"
                )
        return np.array(
            [
                self._number(line, place, cell.strip().replace(",", ".", 1), empty)
                for line, cell in zip(block.lines, cells, strict=True)
            ]
        )

    def notes(self, places: Iterable[int]) -> tuple[str, ...]:
        """Return what was taken for granted in reading these columns."""
        first = next(self.blocks()).cells
        if self.separator != "," and any(COMMA.fullmatch(cell) for k in places for cell in first[k]):
            return ("commas in numbers are taken for decimal points",)
        return ()

    def _csv(self, part: list[tuple[int, str]]) -> list[list[str]]:
        cells = []
        for number, line in part:
            if len(line) > MOST_CELL and max(map(len, line.split(self.separator))) > MOST_CELL:
                raise InputError(f"{self.path}, line {number}: a cell of more than {MOST_CELL} characters")
            if '"' not in line:
                cells.append(line.split(self.separator))
                continue
            try:
                cells += csv.reader([line], delimiter=self.separator)
            except csv.Error as error:
                raise InputError(f"{self.path}, line {number}: not CSV ({error})") from None
        return cells

    def _hint(self, row: list[str]) -> str:
        """Return what may be wrong with a row of too few or too many cells."""
        if any("\n" in cell for cell in row):
            return "; a quote in it does not close where it should"
        if self.separator == "," and len(row) > len(self.names):
            return "; if commas stand for decimal points, separate cells by semicolons"
        return ""

    def _number(self, line: int, place: int, cell: str, empty: bool) -> float:
        if not cell and empty:
            return float("nan")
        try:
            return float(cell)
        except ValueError:
            said = f"{shown(cell)} is not a number{_number_hint(cell)}"
            raise InputError(f"{self._place(line, place)}: {said}") from None

    def _place(self, line: int, place: int) -> str:
        return f"{self.path}, line {line}, column {shortened(self.names[place].strip())}"


def _number_hint(cell: str) -> str:
    """Return what may be wrong with a cell that is no number."""
    if not cell:
        return "; fill the cell or leave the row out"
    if cell.endswith("%"):
        return "; leave out the %, and say what values are with " + advice("scale", "--scale")
    return comma_hint(cell, cell)


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


def open_sheet(
    path: Path,
    text: str,
    fits: Callable[[list[str]], bool],
    rename: Callable[[list[str]], list[str]] | None = None,
) -> Sheet:
    """Return the table of a text; without a line that fits, the first line of content heads it.

    Lines that begin with # and blank ones are left out.

    Parameters
    ----------
    fits : callable
        Whether cells may be the heading.
    rename : callable, optional
        Cells of the heading -> the names that they stand for; raises InputError where they do not.

    Raises
    ------
    InputError
        No heading, or nothing below it.
    """
    lines = text.split("\n")
    content = [(number, line) for number, line in enumerate(lines, 1) if _counts(line)]
    found = find_heading(
        [line for _, line in content], fits if rename is None else partial(_fits, fits, rename)
    )
    if found is None:
        first = content[0][1] if content else ""
        found = 0, max(",;\t", key=first.count)
    place, separator = found
    if len(content) < place + 2:
        raise InputError(f"{path}: no data; the first line names the columns, the next ones hold values")
    start, heading = content[place]
    rows = content[place + 1 :]
    if separator and '"' in text:
        rows = _records(path, lines[start:], start + 1, separator)
    try:
        cells = next(csv.reader([heading], delimiter=separator)) if separator else heading.split()
    except csv.Error as error:
        raise InputError(f"{path}, line {start}: not CSV ({error})") from None
    cells = [cell.strip() for cell in cells]
    if rename is not None:
        cells = rename(cells)
    above = "\n".join(line for _, line in content[:place])
    return Sheet(path, tuple(cells), separator, above, rows)


def _fits(
    fits: Callable[[list[str]], bool], rename: Callable[[list[str]], list[str]], cells: list[str]
) -> bool:
    """Whether cells fit with their new names."""
    try:
        return fits(rename(cells))
    except InputError:
        return False


def _counts(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _records(path: Path, lines: list[str], number: int, separator: str) -> list[tuple[int, str]]:
    """Return the lines of a table, those joined over which a quoted cell runs (RFC 4180, 2.6).

    Raises
    ------
    InputError
        Naming the line: a quote that does not close, or closes only behind a cell of absurd length.
    """
    out: list[tuple[int, str]] = []
    place = 0
    while place < len(lines):
        line, begun = lines[place], place
        place += 1
        if not _counts(line):
            continue
        while '"' in line and _is_open(line, separator):
            more = next((k for k in range(place, len(lines)) if '"' in lines[k]), None)
            size = len(line) + sum(len(each) for each in lines[place : (more or place) + 1])
            if more is None or size > MOST_CELL:
                raise InputError(f"{path}, line {number + begun}: a quote does not close; close or remove it")
            line = "\n".join([line, *lines[place : more + 1]])
            place = more + 1
        out.append((number + begun, line))
    return out


def _is_open(line: str, separator: str) -> bool:
    """Whether a line ends within a quoted cell."""
    try:
        list(csv.reader([line], delimiter=separator, strict=True))
    except csv.Error as error:
        return "unexpected end" in str(error)
    return False

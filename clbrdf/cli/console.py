"""Tables, numbers and progress as every command shows them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from clbrdf.progress import Report, silent

WIDTH_OFF_TERMINAL = 200
"""Columns of a table that goes to a file or a pipe, where nothing wraps."""


class _Console(Console):
    """A console that goes silent when its reader (head, less) has gone: what is left to do is done."""

    def on_broken_pipe(self) -> None:
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def stdout_console() -> Console:
    """Console for results."""
    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDTH_OFF_TERMINAL
    return _Console(width=width, highlight=False, emoji=False, markup=False)


def stderr_console() -> Console:
    """Console for progress and remarks."""
    return Console(stderr=True, highlight=False, emoji=False, markup=False)


def make_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> Table:
    """Return a table; the first `left` columns are set to the left, numbers to the right."""
    texts = list(rows)
    table = Table(
        title=title or None,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 0, 0, 1),
        pad_edge=False,
    )
    for place, name in enumerate(columns):
        # Numbers are never cut: where a terminal is too narrow for them, its lines wrap.
        widest = max([len(name), *(len(row[place]) for row in texts)]) if place >= left else None
        justify: Literal["left", "right"] = "left" if place < left else "right"
        table.add_column(name, justify=justify, no_wrap=place >= left, min_width=widest, overflow="fold")
    for row in texts:
        table.add_row(*row)
    return table


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> None:
    """Print a table made by `make_table`."""
    stdout_console().print(make_table(title, columns, rows, left), crop=False)


def number(value: float, digits: int = 4) -> str:
    """Return a number in few columns: `digits` significant ones, "–" for NaN."""
    if value != value:
        return "–"
    return f"{value:.{digits}g}"


@contextmanager
def progress_bar(label: str) -> Iterator[Report]:
    """Show a bar on standard error while the block runs, on a terminal only; give a `Report`."""
    if not sys.stderr.isatty():  # some versions of rich print empty lines for a bar that is disabled
        yield silent
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=stderr_console(), transient=True) as bar:
        task = bar.add_task(label, total=None)

        def report(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield report

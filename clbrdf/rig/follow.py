"""Watch a measurement that runs in another process, from its segments."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.row import POINT
from clbrdf.rig.segment import read_header, read_rows
from clbrdf.rig.segmentcheck import check_segments
from clbrdf.rig.store import log_path, run_folder, segments

TRIES, PAUSE = 5, 0.05
"""A folder that changes while it is read is read again, after a pause in s."""


@dataclass(frozen=True)
class Progress:
    """How far a measurement is.

    Attributes
    ----------
    points, total : int
        Committed points, and points in all.
    rows : int
        Committed rows of all kinds.
    latest : str
        Time of the latest row, ISO 8601 with zone; "" before the first.
    remaining : float
        Estimated seconds to the end; NaN while nothing is known.
    events : int
        Lines in the log.
    is_complete : bool
        The scan file itself is there.
    """

    points: int
    total: int
    rows: int
    latest: str
    remaining: float
    events: int
    is_complete: bool


def progress_of(path: str | Path) -> Progress:
    """Return how far the measurement for a scan file is, running, interrupted or complete.

    Raises
    ------
    InputError
        There is neither the scan file nor a measurement for it.
    """
    target = Path(path)
    folder = run_folder(target)
    if target.exists():
        raw = read_raw(target)
        count = len(raw.directions)
        latest = bytes(raw.rows["time"][-1]).decode("ascii")
        return Progress(
            count, count, len(raw.rows["kind"]), latest, 0.0, len(raw.log.splitlines()), is_complete=True
        )
    last: Exception | None = None
    for _ in range(TRIES):
        try:
            if folder.exists():
                return _running(folder)
        except (InputError, FileNotFoundError) as error:
            last = error
        # The measurement may have been completed, and its folder removed, while we looked.
        if target.exists():
            return progress_of(target)
        if not folder.exists():
            raise InputError(
                f"{target}: no such file, and no measurement for it in {folder.name}; check the name"
            )
        time.sleep(PAUSE)
    raise InputError(f"{folder}: cannot be read ({last})") from last


def _running(folder: Path) -> Progress:
    paths = segments(folder)
    for path in paths:
        _check_once(path, path.stat().st_ino)
    tables = [read_rows(segment) for segment in paths]
    total = int(read_header(paths[0])["points"] or 0) if paths else 0
    log = log_path(folder)
    events = len(log.read_text(encoding="utf-8").splitlines()) if log.exists() else 0
    rows = sum(len(table["kind"]) for table in tables)
    points = sum(int(np.count_nonzero(table["kind"] == POINT)) for table in tables)
    latest, remaining = "", float("nan")
    if tables and len(tables[-1]["kind"]):
        table = tables[-1]
        first, last = (bytes(table["time"][k]).decode("ascii") for k in (0, -1))
        seconds = (datetime.fromisoformat(last) - datetime.fromisoformat(first)).total_seconds()
        here = int(np.count_nonzero(table["kind"] == POINT))
        latest = last
        if here > 1:
            remaining = seconds / here * (total - points)
    return Progress(points, total, rows, latest, remaining, events, is_complete=False)


@lru_cache(maxsize=64)
def _check_once(path: Path, number: int) -> None:
    """Make sure that HDF5 comes to an end with a segment, when this process meets it first."""
    del number
    check_segments([path])


def follow(path: str | Path, show: Callable[[Progress], None], interval: float = 1.0) -> Progress:
    """Show the progress of a measurement again and again until it is complete; return the last.

    Parameters
    ----------
    path : path
        The scan file that is being measured.
    show : callable
        Told each time something has changed.
    interval : float
        Seconds between two looks.

    Raises
    ------
    InputError
        There is neither the scan file nor a measurement for it.
    """
    before: Progress | None = None
    while True:
        now = progress_of(path)
        if now != before:
            show(now)
        if now.is_complete:
            return now
        before = now
        time.sleep(interval)

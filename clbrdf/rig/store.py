"""Where a running measurement lives: a folder beside its result, with segments, log and a lock.

For `-o scan.h5` it is `scan.h5.run`; `scan.h5` itself appears when everything is measured, whole or not
at all. The lock is a file of its own, held with flock: it goes with the process, however that ends.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from types import TracebackType

import numpy as np

from clbrdf.errors import InputError
from clbrdf.rig.errors import go_on
from clbrdf.rig.row import DARK, POINT, REFERENCES, SATURATED, SKIPPED, Row
from clbrdf.rig.segment import Columns, SegmentWriter, read_header, read_rows
from clbrdf.rig.segmentcheck import check_segments

SEGMENT_PATTERN = "segment-*.h5"


class Lock:
    """Keeps a second process from measuring into the same file.

    Raises
    ------
    InputError
        Another process holds it.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.path = target.with_name(f"{target.name}.lock")
        self._handle = -1

    def __enter__(self) -> Lock:
        while True:
            try:
                handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise InputError(
                    f"{self.target}: cannot be written ({error.strerror}); choose another folder"
                ) from error
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                other = os.read(handle, 32).decode("ascii", "replace").strip()
                os.close(handle)
                raise InputError(
                    f"{self.target}: process {other or 'another'} is measuring into it; wait for its end"
                ) from error
            # The holder before may have removed the name while we waited for the lock.
            try:
                if os.fstat(handle).st_ino == os.stat(self.path).st_ino:
                    break
            except FileNotFoundError:
                pass
            os.close(handle)
        os.ftruncate(handle, 0)
        os.write(handle, f"{os.getpid()}\n".encode("ascii"))
        self._handle = handle
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.path.unlink(missing_ok=True)
        os.close(self._handle)


def run_folder(target: Path) -> Path:
    """Return the folder in which the measurement for a result lives."""
    return target.with_name(f"{target.name}.run")


def log_path(folder: Path) -> Path:
    """Return the log of a measurement."""
    return folder / "log.txt"


def segments(folder: Path) -> list[Path]:
    """Return the segment files, in order."""
    return sorted(folder.glob(SEGMENT_PATTERN))


class Store:
    """All rows of a measurement: those of earlier segments, and a writer for new ones.

    Attributes
    ----------
    folder : Path
    rows : int
        Committed over all segments.
    points : list of Row
        The committed points, in the order in which they were measured.
    brightest : Row or None
        The committed point with the most light in it, counts; the check point.
    last : Row or None
        The last committed row.
    reference : Row or None
        The last incident power.
    base_power : float or None
        Reference power at the first incident power, W.

    Raises
    ------
    InputError
        Segments of another plan or rig, or damaged ones.
    """

    def __init__(self, folder: Path, header: dict[str, str], keep_free: float) -> None:
        self.folder = folder
        self.header = header
        self.keep_free = keep_free
        self.rows = 0
        self.points: list[Row] = []
        self.brightest: Row | None = None
        self.last: Row | None = None
        self.reference: Row | None = None
        self.base_power: float | None = None
        self._writer: SegmentWriter | None = None
        self._darks: dict[int, Row] = {}
        self._references: dict[int, Row] = {}
        check_segments(segments(folder))
        for path in segments(folder):
            found = read_header(path)
            for key in ("plan", "rig"):
                if found.get(f"{key}_fingerprint") != header[f"{key}_fingerprint"]:
                    raise InputError(
                        f"{folder}: was begun with another {key} file; {go_on()} and that one, or remove the"
                        " folder to start again"
                    )
            for row in rows_of(read_rows(path)):
                self._note(row)

    def append(self, row: Row) -> int:
        """Commit a row; return its place over all segments.

        Raises
        ------
        StorageError
            As `SegmentWriter.append`.
        """
        if self._writer is None:
            number = len(segments(self.folder))
            path = self.folder / f"segment-{number:04d}.h5"
            self._writer = SegmentWriter(path, self.header, len(row.counts), self.keep_free)
        self._writer.append(row)
        return self._note(row)

    def dark_of(self, row: Row) -> Row:
        """Return the dark row that a committed row uses."""
        return self._darks[row.dark]

    def reference_of(self, row: Row) -> Row:
        """Return the row of the incident power that a committed point uses."""
        return self._references[row.direct]

    def _note(self, row: Row) -> int:
        place, self.rows = self.rows, self.rows + 1
        self.last = row
        if row.kind == POINT:
            self.points.append(row)
            if not row.flags & (SKIPPED | SATURATED):
                self._compare(row)
        elif row.kind in REFERENCES:
            self.reference = self._references[place] = row
            self.base_power = self.base_power or row.reference_power
        elif row.kind == DARK:
            self._darks[place] = row
        return place

    def _compare(self, row: Row) -> None:
        light = self._light(row)
        if self.brightest is None or light > self._light(self.brightest):
            self.brightest = row

    def _light(self, row: Row) -> float:
        dark = self._darks[row.dark]
        return float(
            row.counts.sum(dtype=np.float64) / row.scans - dark.counts.sum(dtype=np.float64) / dark.scans
        )

    def close(self) -> None:
        """Close the writer."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def rows_of(table: Columns) -> list[Row]:
    """Return the rows of a table as records."""
    return [
        Row(
            int(table["kind"][k]),
            int(table["point"][k]),
            bytes(table["time"][k]).decode("ascii"),
            np.asarray(table["axes"][k], dtype=np.float64),
            float(table["reference_power"][k]),
            float(table["integration_time"][k]),
            int(table["dark"][k]),
            int(table["direct"][k]),
            int(table["flags"][k]),
            np.asarray(table["counts"][k], dtype=np.uint32),
            np.asarray(table["nominal"][k], dtype=np.float64),
            int(table["scans"][k]),
            float(table["temperature"][k]),
            int(table["rung"][k]),
        )
        for k in range(len(table["kind"]))
    ]

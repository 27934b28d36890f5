"""A segment file: rows streamed to HDF5 so that a kill loses nothing that was committed.

What HDF5 does under a kill decides the order (docs/decisions/0011): everything is created first and the
file takes its name only when it is in SWMR mode and synced; then each row is one chunk, its data is
flushed before the counter of committed rows rises, and flush and fsync end the row. A file whose writer
was killed is never written again: a resumed measurement starts the next segment. It is read as an image
in memory (:mod:`clbrdf.rig.segmentimage`). Each row carries a CRC, so that one torn by a power cut is not
taken for whole.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.rig.errors import StorageError, go_on
from clbrdf.rig.row import Row, checksum, columns, row_items, row_values
from clbrdf.rig.segmentimage import image_of
from clbrdf.storage.hdf5 import DAMAGE, FORMAT_VERSION, first_line
from clbrdf.storage.schema import Item, clean, read_items

if TYPE_CHECKING:
    import h5py

Columns = dict[str, npt.NDArray[Any]]

T = TypeVar("T")

CONTENT = "segment"

READINGS, READING_PAUSE = 3, 0.05
"""How often a segment is read that could not be, and the pause between, s."""


class SegmentWriter:
    """Appends rows to a new segment file; each is on the disk when `append` returns.

    Attributes
    ----------
    path : Path
    rows : int
        Committed so far.
    """

    def __init__(self, path: Path, header: dict[str, str], pixels: int, keep_free: float) -> None:
        import h5py

        self.path = path
        self.rows = 0
        self.keep_free = keep_free
        part = path.with_name(f".{path.name}.part")
        part.unlink(missing_ok=True)
        self._sets: list[h5py.Dataset] = []
        self._file: h5py.File | None = h5py.File(part, "x", libver="latest")
        try:
            for key, value in {"content": CONTENT, "clbrdf_format": FORMAT_VERSION, **header}.items():
                self._file.attrs[key] = value
            for column in columns(pixels):
                self._sets.append(self._column(column.name, column.dtype, column.shape, column.units))
            self._checks = self._column("crc", "<u4", (), "")
            self._committed = self._file.create_dataset("committed", data=np.zeros(2, "<u8"))
            self._file.swmr_mode = True
            self._sync()
            os.rename(part, path)
            _sync_folder(path.parent)
        except (OSError, RuntimeError) as error:  # h5py raises both
            self._abandon()
            part.unlink(missing_ok=True)
            raise StorageError(
                f"{path}: cannot be written ({_reason(error)}); the rows of earlier segments are safe: free"
                f" some space, then {go_on()}"
            ) from error

    def _column(self, name: str, dtype: str, shape: tuple[int, ...], units: str) -> h5py.Dataset:
        assert self._file is not None
        dataset = self._file.create_dataset(
            name, (0, *shape), dtype, chunks=(1, *shape), maxshape=(None, *shape)
        )
        dataset.attrs["units"] = units
        return dataset

    def append(self, row: Row) -> int:
        """Commit a row; return its place in this segment.

        Raises
        ------
        StorageError
            The disk is full, or nearly so; the rows before are safe.
        """
        if self._file is None:
            raise StorageError(f"{self.path}: closed")
        free = shutil.disk_usage(self.path.parent).free / 1e6
        if free < self.keep_free:
            raise StorageError(
                f"{self.path.parent}: only {free:.0f} MB free, {self.keep_free:g} MB are to be kept;"
                f" free some space, then {go_on()}"
            )
        place, values = self.rows, row_values(row)
        try:
            for dataset, value in zip(self._sets, values, strict=True):
                dataset.resize(place + 1, axis=0)
                dataset[place] = value
            self._checks.resize(place + 1, axis=0)
            self._checks[place] = checksum(values)
            self._file.flush()
            self._committed[...] = (place + 1, self._file.id.get_filesize())
            self._sync()
        except (OSError, RuntimeError) as error:  # h5py raises both
            self._abandon()
            raise StorageError(
                f"{self.path}: cannot be written ({_reason(error)}); the {place} rows before are safe:"
                f" free some space, then {go_on()}"
            ) from error
        self.rows = place + 1
        return place

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            file, self._file = self._file, None
            file.close()

    def _abandon(self) -> None:
        """Let go of a file that can no longer be written.

        HDF5 would try to write its buffers again when it closes the file or the interpreter ends, and
        crash. The null device takes them instead; what is on the disk stays as it is, and in SWMR mode
        every state of it can be read.
        """
        assert self._file is not None
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, self._file.id.get_vfd_handle())
        os.close(null)
        with suppress(OSError, RuntimeError):
            self.close()

    def _sync(self) -> None:
        assert self._file is not None
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())


def _reason(error: Exception) -> str:
    """Return what HDF5 says about the system's error, or its first line."""
    found = re.search(r"error message = '([^']*)'", str(error))
    return found[1] if found else first_line(error)


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _read(path: Path, take: Callable[[h5py.File], T]) -> T:
    """Return what `take` finds in a segment as it is now; what cannot be read ends at once, in one line.

    A segment that is being written is read between two states now and then, so it is tried three times.
    """
    import h5py

    mend = "restore it from a copy, or remove it to measure its points again"
    for attempt in range(READINGS):
        try:
            with h5py.File(image_of(path), "r") as file:
                if file.attrs.get("content") != CONTENT:
                    raise InputError(f"{path}: no segment of a measurement, or a damaged segment; {mend}")
                length = int(_committed(file)[-1])
                found = path.stat().st_size
                if found < length:
                    raise InputError(f"{path}: cut short, {found} of {length} bytes are there; {mend}")
                return take(file)
        except (*DAMAGE, InputError) as error:
            if isinstance(error, InputError) and str(path) in str(error):
                raise
            if attempt == READINGS - 1:
                raise InputError(f"{path}: damaged segment ({first_line(error)}); {mend}") from error
            time.sleep(READING_PAUSE)
    raise AssertionError("unreachable")


def read_header(path: Path) -> dict[str, str]:
    """Return what a segment was made with: plan, rig, instruments, as text.

    Raises
    ------
    InputError
        The file cannot be read or is no segment.
    """
    return _read(path, lambda file: {clean(key): _plain(value) for key, value in file.attrs.items()})


def _plain(value: Any) -> str:
    return clean(value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value))


def read_rows(path: Path) -> Columns:
    """Return the committed rows of a segment, column by column; also of one that is being written.

    Raises
    ------
    InputError
        The file cannot be read, or a committed row does not match its CRC.
    """
    rows, checks = _read(path, _take_rows)
    count = len(checks)
    for place in range(count):
        # The slice keeps the type: a single string would lose its padding.
        if checksum([values[place : place + 1] for values in rows.values()]) == checks[place]:
            continue
        if place == count - 1:  # torn by a power cut between its data and the sync
            return {name: values[:place] for name, values in rows.items()}
        raise InputError(
            f"{path}: row {place} is damaged; restore the file from a copy, or remove it to measure its"
            " points again"
        )
    return rows


def _take_rows(file: h5py.File) -> tuple[Columns, npt.NDArray[np.uint32]]:
    count = int(_committed(file)[0])
    items = [*row_items(all_required=True), Item("crc", ("R",), kind="bits")]
    written = file["crc"].shape[0]
    if not count <= written <= count + 1:
        raise ValueError(f"{count} rows are committed and {written} written")
    # A writer that was killed may have lengthened some of the columns for the next row.
    found: dict[str, npt.NDArray[Any]] = {}
    for item in items:
        found |= read_items(file, [item], {"P": file["counts"].shape[-1]})
    if any(len(values) < count for values in found.values()):
        raise ValueError(f"{count} rows are committed, and not all are there")
    kept = {name: values[:count] for name, values in found.items()}
    rows = {c.name: kept[c.name].astype(c.dtype, copy=False) for c in columns(1)}
    return rows, kept["crc"]


def _committed(file: h5py.File) -> npt.NDArray[np.int64]:
    """Return the number of committed rows and the bytes of the file with them."""
    return read_items(file, [Item("committed", ("2",), kind="whole")])["committed"]


def count_rows(path: Path) -> int:
    """Return how many rows of a segment are committed.

    Raises
    ------
    InputError
        The file cannot be read or is no segment.
    """
    return _read(path, lambda file: int(_committed(file)[0]))

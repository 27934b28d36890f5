"""What workers do: look at a scan, solve a block of its wavelengths, put the fit together and write it.

A task opens the scan itself where its machine sees the file, and takes the bytes that it is sent where not.
Each finds the OpenCL device of its process.
"""

from __future__ import annotations

import hashlib
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.batch.request import Request
from clbrdf.batch.rows import Rows, rows_of, rows_path, write_rows
from clbrdf.errors import DeviceError, InputError
from clbrdf.fit.jobs import Job, Jobs
from clbrdf.fit.solve import Solution
from clbrdf.opencl.device import choose_device
from clbrdf.scan import Scan
from clbrdf.storage.files import sha256, split_entry
from clbrdf.storage.provenance import Input
from clbrdf.version import __version__

MARKER = "batch.json"
"""The file by which a worker knows that a folder is the one of the batch."""


class UnseenError(Exception):
    """The file of a scan is not seen from this machine."""


class UnfitWorkerError(Exception):
    """A worker cannot take part: its address, and why."""


@dataclass(frozen=True)
class Source:
    """A scan of a batch.

    Attributes
    ----------
    path : str
        Absolute, perhaps with ``::`` and the name of an entry.
    stem : str
        Of its files in the catalogue.
    """

    path: str
    stem: str

    @property
    def file(self) -> Path:
        """The file without the entry."""
        return split_entry(self.path)[0]


@dataclass(frozen=True)
class Look:
    """What a look at a scan tells: SHA-256 of its file, and the number of blocks, 0 for one whole task."""

    sha256: str
    blocks: int


@dataclass(frozen=True, eq=False)
class SolvedBlock:
    """A block that is solved: on which device, and in how many seconds."""

    solution: Solution
    device: str
    seconds: float


@dataclass(frozen=True, eq=False)
class Done:
    """A scan that is fitted: how many wavelengths have each status.

    Where the worker does not see the folder it has written nothing: `rows` and `content`, the bytes of the
    fit's file, are left to the client.
    """

    statuses: dict[str, int]
    rows: Rows | None
    content: bytes | None


@dataclass(frozen=True)
class Able:
    """What a worker says of itself: the version that it runs, its device, or why it has none."""

    version: str
    device: str
    failure: str


def able() -> Able:
    """Say what this worker can do."""
    try:
        return Able(__version__, str(choose_device()), "")
    except DeviceError as error:
        return Able(__version__, "", str(error))


def look(source: Source, data: bytes | None, request: Request) -> Look:
    """Open a scan and count the blocks of its fit."""
    _check_worker(request.version)
    scan, digest = _scan(source, data)
    if not request.in_blocks:
        return Look(digest, 0)
    counting = _Counting()
    try:
        request.fit(scan, counting)
    except _CountedError:
        return Look(digest, counting.blocks)
    return Look(digest, 0)


def solve_block(source: Source, data: bytes | None, request: Request, digest: str, place: int) -> SolvedBlock:
    """Solve one block of a scan's wavelengths."""
    _check_worker(request.version)
    start = time.perf_counter()
    solving = _Solving(place)
    with suppress(_SolvedError):
        request.fit(_same_scan(source, data, digest), solving)
    assert solving.solution is not None
    return SolvedBlock(solving.solution, str(choose_device()), time.perf_counter() - start)


def finish(
    source: Source,
    data: bytes | None,
    request: Request,
    digest: str,
    parts: Sequence[SolvedBlock],
    folder: str,
) -> Done:
    """Put the fit of a scan together and write it, whole; do all of it where there are no parts."""
    _check_worker(request.version)
    start = time.perf_counter()
    scan, known = _same_scan(source, data, digest), _Known(parts)
    entry = Input(Path(source.path).name, digest)
    write: Callable[[Path], None]
    if request.choose:
        choice = request.choice(scan)
        fitted = replace(choice.fit, provenance=request.made(entry, choice.fit, choice.weights))
        write = partial(replace(choice, fit=fitted).save, overwrite=True)
    else:
        fitted = request.fit(scan, known if parts else None)
        fitted = replace(fitted, provenance=request.made(entry, fitted, request.weights or "none"))
        if {part.device for part in parts} - {str(choose_device())}:
            devices = " and ".join(sorted({part.device for part in parts}))
            fitted = replace(fitted, search=replace(fitted.search, device=devices))
        write = partial(fitted.save, overwrite=True)
    target = Path(folder) / f"{source.stem}.h5"
    content, is_here = None, _is_here(Path(folder), request)
    if is_here:
        write(target)
        size, fit_hash = target.stat().st_size, sha256(target)
    else:
        with tempfile.TemporaryDirectory(prefix="clbrdf-batch-") as here:
            path = Path(here) / "fit.h5"
            write(path)
            content = path.read_bytes()
        size, fit_hash = len(content), hashlib.sha256(content).hexdigest()
    milliseconds = known.milliseconds(len(scan.wavelength))
    milliseconds += 1e3 * (time.perf_counter() - start) / len(scan.wavelength)
    rows = rows_of(source.stem, fitted, milliseconds, digest, fit_hash, size)
    names, counts = np.unique(fitted.status, return_counts=True)
    statuses = dict(zip(names.tolist(), counts.tolist(), strict=True))
    if is_here:
        write_rows(rows_path(Path(folder), source.stem), rows, request.digest())
    return Done(statuses, None if is_here else rows, content)


@cache
def _check_worker(version: str) -> None:
    """Raise UnfitWorkerError where this worker runs another version, or has no device."""
    from distributed import get_worker

    own = able()
    failure = own.failure if own.version == version else f"runs clbrdf {own.version}, not {version}"
    if failure:
        raise UnfitWorkerError(str(get_worker().address), failure)


def _scan(source: Source, data: bytes | None) -> tuple[Scan, str]:
    """Return a scan and the SHA-256 of its file."""
    if data is not None:
        digest = hashlib.sha256(data).hexdigest()
        with tempfile.TemporaryDirectory(prefix="clbrdf-batch-") as folder:
            path = Path(folder) / source.file.name
            path.write_bytes(data)
            try:
                return Scan.open(str(path) + source.path[len(str(source.file)) :]), digest
            except InputError as error:
                raise InputError(str(error).replace(f"{folder}/", "")) from error
    try:
        found = source.file.stat()
    except OSError as error:
        raise UnseenError(source.path) from error
    return _opened(source.path, str(source.file), found.st_size, found.st_mtime_ns)


@lru_cache(maxsize=2)
def _opened(path: str, file: str, _size: int, _changed: int) -> tuple[Scan, str]:
    return Scan.open(path), sha256(file)


def _same_scan(source: Source, data: bytes | None, digest: str) -> Scan:
    """Return a scan whose file has not changed.

    Raises
    ------
    InputError
        It has.
    """
    scan, found = _scan(source, data)
    if found != digest:
        raise InputError(f"{source.path}: changed while the batch ran; run it again with --resume")
    return scan


def _is_here(folder: Path, request: Request) -> bool:
    """Whether this machine sees the folder of the batch."""
    try:
        return request.digest() in (folder / MARKER).read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False


class _CountedError(Exception):
    """All that was asked for is known."""


class _SolvedError(Exception):
    """All that was asked for is known."""


class _Counting:
    """An executor that counts the jobs of a fit and ends it there."""

    blocks = 0

    def map(self, function: Callable[[Any], Any], jobs: Iterable[Any], /) -> Iterable[Any]:
        assert isinstance(jobs, Jobs)
        del function
        self.blocks = len(jobs)
        raise _CountedError


class _Solving:
    """An executor that runs one job of a fit and ends it there."""

    def __init__(self, place: int) -> None:
        self.place = place
        self.solution: Solution | None = None

    def map(self, function: Callable[[Any], Any], jobs: Iterable[Any], /) -> Iterable[Any]:
        assert isinstance(jobs, Jobs)
        job: Job = jobs[self.place]
        self.solution = function(job)
        raise _SolvedError


class _Known:
    """An executor whose jobs are done already."""

    def __init__(self, parts: Sequence[SolvedBlock]) -> None:
        self.parts = parts
        self.blocks: Sequence[npt.NDArray[np.intp]] = ()

    def map(self, function: Callable[[Any], Any], jobs: Iterable[Any], /) -> Iterable[Any]:
        assert isinstance(jobs, Jobs)
        del function
        self.blocks = jobs.blocks
        return [part.solution for part in self.parts]

    def milliseconds(self, wavelengths: int) -> npt.NDArray[np.float64]:
        """Return what each wavelength took of the time of its block, (W,) ms."""
        out = np.zeros(wavelengths)
        for block, part in zip(self.blocks, self.parts, strict=False):
            out[block] = 1e3 * part.seconds / len(block)
        return out

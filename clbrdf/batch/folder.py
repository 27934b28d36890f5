"""The folder of a catalogue: whose it is, what is done in it, and its index.

``batch.json`` names the settings, ``NAME.h5`` is the fit of a scan, ``rows/NAME.parquet`` its rows with the
hashes of input and settings, written after the fit: where it stands, the scan is done. All rows together are
``index.parquet``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clbrdf.batch.request import Request
from clbrdf.batch.rows import LAST, ROWS, rows_path, write_rows
from clbrdf.batch.tasks import MARKER, Done, Source
from clbrdf.errors import InputError
from clbrdf.parallel.ending import undone_at_end
from clbrdf.storage.files import whole_file, whole_text

if TYPE_CHECKING:
    import pyarrow as pa

INDEX = "index.parquet"

LOCK = ".lock"


@dataclass(frozen=True)
class Catalogue:
    """The folder of a batch; made by `open_catalogue`."""

    folder: Path
    request: Request

    def is_done(self, source: Source, scan_sha256: str) -> bool:
        """Whether a scan with this hash is done with these settings."""
        import pyarrow.parquet as pq

        target = self.folder / f"{source.stem}.h5"
        try:
            kept = pq.read_schema(rows_path(self.folder, source.stem)).metadata or {}
            wanted = {"scan_sha256": scan_sha256, "request": self.request.digest()}
            wanted["fit_bytes"] = str(target.stat().st_size)
        except (OSError, ValueError):
            return False
        return all(kept.get(name.encode()) == value.encode() for name, value in wanted.items())

    def keep(self, source: Source, done: Done) -> None:
        """Keep what came of a scan where the worker has not: its fit, then its rows.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        if done.content is not None:
            with whole_file(self.folder / f"{source.stem}.h5", overwrite=True) as part:
                part.write_bytes(done.content)
        if done.rows is not None:
            write_rows(rows_path(self.folder, source.stem), done.rows, self.request.digest())

    def write_index(self) -> int:
        """Write the rows of all scans of the folder as one table; return how many scans there are.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        files = sorted((self.folder / ROWS).glob("[!.]*.parquet"))
        if not files:
            return 0
        schema = pa.unify_schemas([pq.read_schema(file).remove_metadata() for file in files])
        with (
            whole_file(self.folder / INDEX, overwrite=True) as part,
            pq.ParquetWriter(part, _in_order(schema)) as writer,
        ):
            for file in files:
                table = pq.read_table(file)
                for field in schema:
                    if field.name not in table.column_names:
                        table = table.append_column(field, pa.nulls(len(table), field.type))
                writer.write_table(table.select(writer.schema.names).replace_schema_metadata(None))
        return len(files)

    def clear(self) -> None:
        """Remove what was half written when a process was ended from outside."""
        for folder in (self.folder, self.folder / ROWS):
            for part in folder.glob(".*.part"):
                with suppress(OSError):
                    part.unlink()


@contextmanager
def open_catalogue(folder: Path, request: Request, resume: bool) -> Iterator[Catalogue]:
    """Give the folder of a batch, made where it is new, for as long as the block runs.

    Raises
    ------
    InputError
        It holds something else, or another batch, or this one and `resume` is False; another process works
        in it; it cannot be written.
    """
    import fcntl

    marker = folder / MARKER
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name a folder")
    held = [path.name for path in folder.iterdir() if path.name != LOCK] if folder.is_dir() else []
    if held and MARKER not in held:
        raise InputError(f"{folder}: holds other files, such as {min(held)}; name an empty or a new folder")
    try:
        (folder / ROWS).mkdir(parents=True, exist_ok=True)
        with open(folder / LOCK, "w", encoding="utf-8") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(f"{folder}: another batch is at work in it; wait for its end") from error
            if held:
                _check_same(folder, request, _read_marker(marker), resume)
            else:
                content = {
                    "made_by": "clbrdf batch",
                    "sha256": request.digest(),
                    "settings": request.identity(),
                }
                whole_text(marker, content)
            catalogue = Catalogue(folder, request)
            catalogue.clear()
            # Local workers, which begin later, have ended by the time that a signal clears the folder.
            with undone_at_end(catalogue.clear):
                try:
                    yield catalogue
                finally:
                    catalogue.clear()
    except OSError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{folder}: cannot be written ({error.strerror}); choose another folder") from error


def _read_marker(marker: Path) -> dict[str, Any]:
    try:
        content = json.loads(marker.read_text(encoding="utf-8"))
        return dict(content["settings"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{marker}: is damaged; name another folder") from error


def _check_same(folder: Path, request: Request, there: dict[str, Any], resume: bool) -> None:
    """Raise InputError where the folder is that of another batch, or it is not to be gone on with."""
    own = request.identity()
    different = [name for name in own if there.get(name) != own[name]]
    if different:
        name = different[0]
        raise InputError(
            f"{folder}: holds another batch, with {name} {there.get(name)!r} and not {own[name]!r}; name"
            " another folder"
        )
    if not resume:
        raise InputError(f"{folder}: holds this batch already; add --resume to go on, or name another folder")


def _in_order(schema: pa.Schema) -> pa.Schema:
    """Return a schema with the last columns last, whatever parameters several models have added."""
    import pyarrow as pa

    return pa.schema([f for f in schema if f.name not in LAST] + [schema.field(name) for name in LAST])

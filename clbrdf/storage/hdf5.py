"""Common ground of the HDF5 files: opening them with clear messages, versions, provenance, strings.

Layout: the root names the format, its version and what the file holds; `/entry` is an NXentry with
`@default` down to an NXdata, so that NeXus viewers show the data at once. A file of several scans has one
NXentry each, named as in ``file.h5::name``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import ClbrdfError, InputError, advice, shortened
from clbrdf.storage.files import split_entry, whole_file
from clbrdf.storage.schema import check_group, clean, read_text, text_attribute
from clbrdf.storage.seal import seal
from clbrdf.storage.sink import Sink
from clbrdf.storage.sound import check_sound

if TYPE_CHECKING:
    import h5py

__all__ = [
    "FORMAT_VERSION",
    "add_entry",
    "check_content",
    "check_written",
    "content_of",
    "create_file",
    "entry_names",
    "field",
    "find_entry",
    "first_line",
    "group",
    "open_file",
    "read_mapping",
    "read_text",
    "write_mapping",
]

FORMAT_VERSION = 2
"""Rises when older programs could misread a newer file; files above it are refused.

2 adds directions of transmission, bands without wavelengths, and several entries in a file; files of
version 1 are read as ever.
"""

MOST_NAMES = 12
"""Entries that a message lists."""

DAMAGE = (
    *(OSError, RuntimeError, TypeError, ValueError, AttributeError, LookupError, ArithmeticError),
    *(MemoryError, BufferError, AssertionError),
)
"""What h5py raises where a file says what it cannot read: types, sizes, references and texts of any kind.
What the schema refuses is an InputError, and names its place."""

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


@contextmanager
def open_file(path: str | Path) -> Iterator[h5py.File]:
    """Open one of our files for reading.

    Raises
    ------
    InputError
        Missing, not HDF5, truncated, not one of our files, or of a newer format version; also where
        something in it is missing or damaged, found while the block runs.
    """
    import h5py

    source, _ = split_entry(path)
    if not source.exists():
        raise InputError(f"{source}: no such file")
    if source.is_dir():
        raise InputError(f"{source}: is a folder; name a file in it")
    try:
        with open(source, "rb") as stream:
            signature = stream.read(len(HDF5_SIGNATURE))
    except PermissionError as error:
        raise InputError(f"{source}: cannot be read; check its permissions") from error
    if signature != HDF5_SIGNATURE:
        raise InputError(f"{source}: not an HDF5 file; bring measured text in with 'clbrdf import'")
    check_sound(source)
    try:
        file = h5py.File(source, "r")
    except OSError as error:
        raise InputError(f"{source}: damaged or locked HDF5 file ({first_line(error)})") from error
    with file:
        try:
            _check_version(source, file)
            yield file
        except ClbrdfError:
            raise
        except KeyError as error:
            said = first_line(error)
            raise InputError(f"{source}: {said}; the file is incomplete, make it again") from error
        except DAMAGE as error:
            raise InputError(f"{source}: damaged HDF5 file ({first_line(error)}); make it again") from error


def entry_names(file: h5py.File) -> list[str]:
    """Return the names of a file's entries, that of @default first, then in alphabetical order."""
    names = sorted(
        name
        for name in file
        if name in file and name == clean(name) and text_attribute(file[name], "NX_class") == "NXentry"
    )
    default = text_attribute(file, "default")
    return sorted(names, key=lambda name: name != default)


def find_entry(file: h5py.File, path: str | Path) -> h5py.Group:
    """Return the entry that a path names, as in ``file.h5::name``, or the only one.

    Raises
    ------
    InputError
        There is no such entry; there are several and none is named; there is none at all.
    """
    source, name = split_entry(path)
    names = entry_names(file)
    if not names:
        raise InputError("there is no entry in it; the file is incomplete, make it again")
    listed = ", ".join(names[:MOST_NAMES]) + (", …" if len(names) > MOST_NAMES else "")
    if name and name not in names:
        raise InputError(f"no entry is called {name!r}; there are {listed}")
    if not name and len(names) > 1:
        raise InputError(
            f"holds {len(names)} scans; name one of them, as in {source.name}::{names[0]}: {listed}"
        )
    entry = file[name or names[0]]
    check_group(entry)
    return entry


def first_line(error: Exception) -> str:
    """Return the first line of an error's text."""
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    return clean((text.strip().splitlines() or [type(error).__name__])[0])


def _check_version(source: Path, file: h5py.File) -> None:
    if "clbrdf_format" not in file.attrs:
        raise InputError(f"{source}: not a file of clbrdf (no clbrdf_format at its root)")
    version = file.attrs["clbrdf_format"]
    if not isinstance(version, np.integer):
        raise InputError(
            f"{source}: clbrdf_format is {shortened(repr(version))}, not a whole number; make the file again"
        )
    if version < 1:
        raise InputError(f"{source}: format version {version} does not exist; make the file again")
    if version > FORMAT_VERSION:
        raise InputError(
            f"{source}: format version {version}, newer than the {FORMAT_VERSION} known here; update clbrdf"
        )


def content_of(file: h5py.File) -> str:
    """Return what a file holds: "scan" or "fit"."""
    return text_attribute(file, "content", "unknown")


def check_content(file: h5py.File, wanted: str) -> None:
    """Raise InputError where a file holds something else than `wanted`."""
    found = content_of(file)
    if found != wanted:
        make = advice("fit it with clbrdf.fit", "fit it with 'clbrdf fit'")
        mend = f"; {make}" if (found, wanted) == ("scan", "fit") else ""
        raise InputError(f"{file.filename}: holds a {found}, and a {wanted} is needed here{mend}")


@contextmanager
def create_file(
    path: str | Path, content: str, title: str, overwrite: bool, entry: str = "entry"
) -> Iterator[h5py.File]:
    """Create a file with one entry under a temporary name; it gets its own when the block has ended well.

    Raises
    ------
    InputError
        The file exists and may not be replaced, or cannot be written.
    """
    import h5py

    with whole_file(path, overwrite) as part:
        sink = Sink(part)
        try:
            with h5py.File(sink, "w") as file:
                file.sink = sink
                file.attrs["NX_class"] = "NXroot"
                file.attrs["default"] = entry
                file.attrs["creator"] = "clbrdf"
                file.attrs["clbrdf_format"] = FORMAT_VERSION
                file.attrs["content"] = content
                add_entry(file, entry, title)
                yield file
        except DAMAGE:
            sink.check()  # what HDF5 misses follows from what could not be written
            raise
        finally:
            sink.close()
        sink.check()
        seal(part)


def check_written(file: h5py.File) -> None:
    """Raise the system's error where a file of `create_file` could not be written so far.

    HDF5 is not told of it, since it would crash; work that takes long asks now and then.
    """
    file.sink.check()


def add_entry(file: h5py.File, name: str, title: str) -> h5py.Group:
    """Create an entry whose data are in its NXdata `data`."""
    entry = group(file, name, "NXentry")
    entry.attrs["default"] = "data"
    entry["title"] = title
    return entry


def group(parent: h5py.Group, name: str, nexus_class: str) -> h5py.Group:
    """Create a group of a NeXus class."""
    child = parent.create_group(name)
    child.attrs["NX_class"] = nexus_class
    return child


def field(
    parent: h5py.Group, name: str, values: npt.ArrayLike, units: str, long_name: str = ""
) -> h5py.Dataset:
    """Write an array with its units; two-dimensional ones in compressed chunks."""
    array = np.asarray(values)
    options: dict[str, Any] = {}
    if array.ndim > 1 and array.size > 0:
        options = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    dataset = parent.create_dataset(name, data=array, **options)
    # Else its chunks get their places when the last reference goes, which a profiler or a traceback may hold.
    dataset.flush()
    dataset.attrs["units"] = units
    if long_name:
        dataset.attrs["long_name"] = long_name
    return dataset


def write_mapping(parent: h5py.Group, name: str, mapping: Mapping[str, str]) -> None:
    """Write provenance: one string a key, in order, as an NXprocess."""
    process = parent.create_group(name, track_order=True)
    process.attrs["NX_class"] = "NXprocess"
    process["program"] = "clbrdf"
    for key, value in mapping.items():
        process.attrs[key] = value


def read_mapping(parent: h5py.Group, name: str) -> dict[str, str]:
    """Read what `write_mapping` wrote."""
    check_group(parent)
    group = parent[name]
    return {clean(key): text_attribute(group, key) for key in group.attrs if key != "NX_class"}

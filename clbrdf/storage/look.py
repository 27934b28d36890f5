"""Read all of an HDF5 file, as a program of its own: what hangs or crashes HDF5 ends this process only.

`sound.py` starts it as a file, so that it loads nothing but h5py. It prints what is wrong in one line and
exits with 1, or with 0 where everything could be read.
"""

from __future__ import annotations

import resource
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

MOST_OBJECTS = 100_000
MOST_CHUNK = 1 << 28
"""Bytes of one chunk; libraries choose a MiB."""

MOST_TEXT = 1 << 26
"""Bytes of an attribute, or of a list of texts."""

SLICE = 1 << 24
"""Bytes read at once."""


def look(path: str) -> None:
    """Read links, attributes and values of a file.

    Raises
    ------
    ValueError
        It points to other files, or claims sizes that nothing of ours has.
    Exception
        Whatever h5py raises on a damaged file.
    """
    import h5py

    with h5py.File(path, "r") as file:
        _attributes(file)
        waiting: list[Any] = [file]
        seen = {h5py.h5o.get_info(file.id).addr}
        while waiting:
            group = waiting.pop()
            for name in group:
                link = group.get(name, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise ValueError(f"{group.name}/{name} stands in another file")
                if isinstance(link, h5py.SoftLink):
                    continue
                item = group[name]
                place = h5py.h5o.get_info(item.id).addr
                if place in seen:
                    continue
                seen.add(place)
                if len(seen) > MOST_OBJECTS:
                    raise ValueError(f"more than {MOST_OBJECTS} groups and arrays")
                _attributes(item)
                if isinstance(item, h5py.Group):
                    waiting.append(item)
                elif isinstance(item, h5py.Dataset):
                    _values(item)


def _attributes(item: Any) -> None:
    for name in item.attrs:
        attribute = item.attrs.get_id(name)
        if 0 in (attribute.shape or ()):
            continue  # an empty list, for which HDF5 has no size
        size = attribute.get_storage_size()
        if size > MOST_TEXT:
            raise ValueError(f"{item.name}: attribute {name} claims {size} bytes")
        item.attrs[name]


def _values(dataset: Any) -> None:
    """Read a dataset in slices; contiguous numbers, in which nothing can go astray, at their ends only."""
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"{dataset.name} stands in another file")
    stored, shape, width = dataset.id.get_storage_size(), dataset.shape, dataset.dtype.itemsize
    if shape is None or stored == 0 or 0 in shape:
        return
    count = 1
    for length in shape:
        count *= int(length)
    if dataset.dtype.kind == "O" and count * 16 > max(stored, MOST_TEXT):
        raise ValueError(f"{dataset.name} claims {count} texts, and the file stores {stored} bytes")
    if shape == ():
        if width <= MOST_TEXT:
            dataset[()]
        return
    chunks = dataset.chunks
    if chunks is None and dataset.dtype.kind != "O":
        dataset[(0,) * len(shape)], dataset[tuple(length - 1 for length in shape)]
        return
    if chunks is not None:
        size = width
        for length in chunks:
            size *= int(length)
        if size > MOST_CHUNK:
            raise ValueError(f"{dataset.name} has chunks of {size} bytes")
    _slices(dataset, (), count * width)


def _slices(dataset: Any, place: tuple[int, ...], size: int) -> None:
    """Read all below a place in parts of at most SLICE bytes, or of a chunk's rows."""
    axis = len(place)
    length = int(dataset.shape[axis])
    rows = max(1, SLICE * length // max(size, 1))
    if rows == 1 and axis + 1 < len(dataset.shape) and size // length > 4 * SLICE:
        for k in range(length):
            _slices(dataset, (*place, k), size // length)
        return
    if dataset.chunks is not None:
        rows = -(-rows // dataset.chunks[axis]) * dataset.chunks[axis]
    for start in range(0, length, rows):
        dataset[(*place, slice(start, min(start + rows, length)))]


def limit(memory: int, seconds: int) -> None:
    """End this process where it takes so many bytes more than it holds, or so many seconds of processor."""
    for kind, most in (
        (resource.RLIMIT_AS, _held() + memory),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _held() -> int:
    """Return the addresses that this process holds, bytes: libraries count there, used or not."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except OSError:  # a system without /proc
        return 1 << 31
    return pages * resource.getpagesize()


def main(words: list[str]) -> int:
    """Look at a file: path, bytes of memory, seconds of processor time."""
    import_module("h5py")  # what it holds does not count
    limit(int(words[1]), int(words[2]))
    try:
        look(words[0])
    except Exception as error:
        text = str(error).strip() or type(error).__name__
        print(text.splitlines()[0][:300].encode("ascii", "replace").decode("ascii"), flush=True)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Arrays in an HDF5 group: shape, type, size and units are looked at before anything is read.

A damaged or hostile header may claim any shape. What is claimed is held against what the file stores,
so that no more memory is asked for than the file can fill. Scans, fits, choices, raw measurements and
segments say what they hold as lists of `Item`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, shortened
from clbrdf.storage.units import factor

if TYPE_CHECKING:
    import h5py

MOST_COMPRESSION = 1100
"""Deflate makes of one byte at most 1032."""

LONGEST_TEXT = 1 << 24
"""Bytes of a string of fixed length."""

MOST_TEXTS = 1 << 20
"""Strings in a list."""

TEXT_BYTES = 16
"""Bytes that a string of any length takes where its list stands."""

KINDS = {"real": "fiu", "whole": "ui", "bits": "ui", "truth": "bui", "bytes": "S"}
WORDS = {
    "real": "numbers",
    "whole": "whole numbers",
    "bits": "whole numbers",
    "truth": "true or false",
    "bytes": "texts of fixed length",
}


@dataclass(frozen=True)
class Item:
    """One array of a group.

    Attributes
    ----------
    name : str
    axes : tuple of str
        A letter for each axis; axes with the same letter have the same length, in all of a group. A number
        is the length itself. None for a single value.
    units : mapping of str to float, or None
        Known units and their factors; None where the array has none.
    kind : "real", "whole", "bits", "truth" or "bytes"
        Read as float64, int64, uint32, bool or as it stands.
    required : bool
    """

    name: str
    axes: tuple[str, ...] = ()
    units: Mapping[str, float] | None = None
    kind: str = "real"
    required: bool = True


def read_items(
    group: h5py.Group, items: Sequence[Item], lengths: Mapping[str, int] | None = None
) -> dict[str, npt.NDArray[Any]]:
    """Check all items of a group, then read them.

    Parameters
    ----------
    lengths : mapping of str to int, optional
        Axes whose length is known.

    Raises
    ------
    InputError
        Naming the dataset: of another type or shape than the others need, larger than what the file
        stores or than this machine's memory, without a known unit, or with a number that its type does
        not hold.
    KeyError
        A required item is missing.
    """
    check_group(group)
    known: dict[str, int] = dict(lengths or {})
    wanted = [item for item in items if item.required or item.name in group]
    factors = {item.name: _checked(group[item.name], item, known) for item in wanted}
    total = 8 * sum(math.prod(group[item.name].shape) for item in wanted)
    if total > _memory():
        raise InputError(
            f"{clean(group.name)} holds {total / 1e9:.3g} GB, and this machine has {_memory() / 1e9:.3g} GB"
        )
    return {item.name: _read(group[item.name], item.kind, factors[item.name]) for item in wanted}


def check_group(item: Any) -> None:
    """Raise InputError where something else than a group stands."""
    if not hasattr(item, "keys"):
        raise InputError(
            f"{clean(getattr(item, 'name', None) or '/')} is no group; the file is damaged, make it again"
        )


def _memory() -> int:
    """Return the bytes of memory of this machine."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def _checked(dataset: Any, item: Item, lengths: dict[str, int]) -> float:
    """Return the factor of an item's units."""
    name = clean(getattr(dataset, "name", None) or item.name)
    shape = getattr(dataset, "shape", None)
    if shape is None or not hasattr(dataset, "dtype"):
        raise InputError(f"{name} is no array; the file is damaged, make it again")
    dtype = dataset.dtype
    if dtype.kind not in KINDS[item.kind] or (item.kind != "bytes" and dtype.itemsize > 8):
        raise InputError(
            f"{name} holds {shortened(str(dtype))}, and {WORDS[item.kind]} are needed; the file is damaged,"
            " make it again"
        )
    if len(shape) != len(item.axes):
        raise InputError(f"{name} has {len(shape)} dimensions and needs {len(item.axes)}")
    known = all(axis in lengths or axis.isdigit() for axis in item.axes)
    needed = tuple(
        int(axis) if axis.isdigit() else lengths.setdefault(axis, length)
        for axis, length in zip(item.axes, shape, strict=True)
    )
    if shape != needed:
        raise InputError(f"{name} has shape {shape}, and the other arrays need {needed}")
    size = dtype.itemsize * math.prod(int(length) for length in shape)
    stored = dataset.id.get_storage_size()
    # An array that was never written takes no room, and its shape has been held against the others'.
    if size > MOST_COMPRESSION * stored and not (known and stored == 0):
        raise InputError(
            f"{name} claims {size} bytes, and the file stores {stored} of them; it is damaged, make it again"
        )
    if item.units is None:
        return 1.0
    try:
        return factor(item.units, text_attribute(dataset, "units"))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _read(dataset: Any, kind: str, scale: float) -> npt.NDArray[Any]:
    found = np.asarray(dataset[()])
    if kind == "bytes":
        return found
    if kind == "truth":
        return found.astype(bool)
    if kind == "real":
        values = found.astype(np.float64)
        if scale != 1.0:
            values *= scale
        values.flags.writeable = False
        return values
    target = np.iinfo(np.uint32 if kind == "bits" else np.int64)
    if found.size and (int(found.min()) < target.min or int(found.max()) > target.max):
        raise InputError(
            f"{clean(dataset.name)} holds a number beyond {target.min} to {target.max}; the file is damaged,"
            " make it again"
        )
    return found.astype(target.dtype, copy=False)


def clean(text: str) -> str:
    """Return a text that any program can write: bytes that are no UTF-8 become a mark."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def _text(value: Any) -> str | None:
    """Return a value as a text, None where it is none."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return clean(value) if isinstance(value, str) else None


def text_attribute(item: Any, name: str, missing: str = "") -> str:
    """Return an attribute that is a text, `missing` where there is none or it is something else."""
    found = _text(item.attrs.get(name, missing))
    return missing if found is None else found


def text_list_attribute(item: Any, name: str) -> list[str]:
    """Return an attribute that is a list of texts.

    Raises
    ------
    InputError
        It is missing or something else.
    """
    texts = [_text(value) for value in np.ravel(item.attrs.get(name)).tolist()]
    found = [text for text in texts if text is not None]
    if not found or len(found) < len(texts):
        raise InputError(f"{clean(item.name)} has no list of {name}; the file is damaged, make it again")
    return found


def read_text(parent: h5py.Group, name: str) -> str:
    """Read a string, "" where there is none.

    Raises
    ------
    InputError
        Something else than one string stands there.
    """
    check_group(parent)
    if name not in parent:
        return ""
    dataset = parent[name]
    kind = getattr(getattr(dataset, "dtype", None), "kind", "")
    if kind not in "SO" or not kind or dataset.shape != () or dataset.dtype.itemsize > LONGEST_TEXT:
        raise InputError(f"{clean(dataset.name)} is no text; the file is damaged, make it again")
    found = _text(dataset[()])
    if found is None:
        raise InputError(f"{clean(dataset.name)} is no text; the file is damaged, make it again")
    return found


def read_texts(parent: h5py.Group, name: str, length: int | None = None) -> tuple[str, ...]:
    """Read a list of strings, of `length` where it is given; an empty one has no type of its own.

    Raises
    ------
    InputError
        Something else stands there, or a list of another length.
    KeyError
        Nothing stands there.
    """
    check_group(parent)
    dataset = parent[name]
    shape, kind = getattr(dataset, "shape", None), getattr(getattr(dataset, "dtype", None), "kind", "")
    place = clean(getattr(dataset, "name", None) or name)
    if shape is None or len(shape) != 1 or (kind not in ("O", "S") and shape != (0,)):
        raise InputError(f"{place} is no list of texts; the file is damaged, make it again")
    if length is not None and shape[0] != length:
        raise InputError(f"{place} holds {shape[0]} texts, and {length} are needed")
    stored = dataset.id.get_storage_size()
    width = TEXT_BYTES if kind == "O" else dataset.dtype.itemsize
    if shape[0] > MOST_TEXTS or shape[0] * width > max(MOST_COMPRESSION * stored, LONGEST_TEXT):
        raise InputError(
            f"{place} claims {shape[0]} texts, and the file stores {stored} bytes; it is damaged,"
            " make it again"
        )
    texts = [_text(value) for value in dataset[()].tolist()] if shape[0] else []
    found = tuple(text for text in texts if text is not None)
    if len(found) < len(texts):
        raise InputError(f"{place} is no list of texts; the file is damaged, make it again")
    return found

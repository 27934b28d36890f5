"""Arrays in an HDF5 group: shape, type, size and units are looked at before anything is read.

A damaged or hostile header may claim any shape. What is claimed is held against what the file stores,
so that no more memory is asked for than the file can fill.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.storage.units import factor

if TYPE_CHECKING:
    import h5py

MOST_COMPRESSION = 1100
"""Deflate makes of one byte at most 1032."""

UNWRITTEN = 1 << 32
"""Bytes that an array which was never written may claim."""

LONGEST_TEXT = 1 << 24
"""Bytes of a string of fixed length."""

KINDS = {"real": "fiu", "bits": "ui"}


@dataclass(frozen=True)
class Item:
    """One array of a group.

    Attributes
    ----------
    name : str
    axes : tuple of str
        A letter for each axis; axes with the same letter have the same length.
    units : mapping of str to float, or None
        Known units and their factors; None where the array has none.
    kind : "real" or "bits"
    required : bool
    """

    name: str
    axes: tuple[str, ...]
    units: Mapping[str, float] | None = None
    kind: str = "real"
    required: bool = True


def read_items(group: h5py.Group, items: Sequence[Item]) -> dict[str, npt.NDArray[Any]]:
    """Check all items of a group, then read them: float64 in our units, or uint32.

    Raises
    ------
    InputError
        Naming the dataset: of another type or shape than the others need, larger than what the file
        stores, or without a known unit.
    KeyError
        A required item is missing.
    """
    check_group(group)
    lengths: dict[str, int] = {}
    factors = {
        item.name: _checked(group[item.name], item, lengths)
        for item in items
        if item.required or item.name in group
    }
    return {name: _read(group[name], scale) for name, scale in factors.items()}


def check_group(item: Any) -> None:
    """Raise InputError where something else than a group stands."""
    if not hasattr(item, "keys"):
        raise InputError(f"{getattr(item, 'name', '/')} is no group; the file is damaged, make it again")


def check_sizes(group: h5py.Group) -> None:
    """Raise InputError where an array below a group claims more than the file can have stored of it."""

    def look(name: str, item: Any) -> None:
        del name
        shape, dtype = getattr(item, "shape", None), getattr(item, "dtype", None)
        if shape is None or dtype is None:
            return
        size = dtype.itemsize * int(np.prod([int(length) for length in shape], dtype=object))
        stored = item.id.get_storage_size()
        if size > max(MOST_COMPRESSION * stored, 0 if stored else UNWRITTEN):
            raise InputError(
                f"{item.name} claims {size} bytes, and the file stores {stored} of them;"
                " it is damaged, make it again"
            )

    check_group(group)
    group.visititems(look)


def _checked(dataset: Any, item: Item, lengths: dict[str, int]) -> float | None:
    """Return the factor of an item's units, None for bits."""
    shape = getattr(dataset, "shape", None)
    if shape is None or not hasattr(dataset, "dtype"):
        raise InputError(f"{dataset.name} is no array; the file is damaged, make it again")
    if dataset.dtype.kind not in KINDS[item.kind] or dataset.dtype.itemsize > 8:
        raise InputError(
            f"{dataset.name} holds {dataset.dtype}, no numbers; the file is damaged, make it again"
        )
    if len(shape) != len(item.axes):
        raise InputError(f"{dataset.name} has {len(shape)} dimensions and needs {len(item.axes)}")
    known = all(axis in lengths for axis in item.axes)
    for axis, length in zip(item.axes, shape, strict=True):
        if lengths.setdefault(axis, length) != length:
            needed = tuple(lengths[a] for a in item.axes if a in lengths)
            raise InputError(f"{dataset.name} has shape {shape}, and the other arrays need {needed}")
    size = dataset.dtype.itemsize * int(np.prod([int(length) for length in shape], dtype=object))
    stored = dataset.id.get_storage_size()
    # An array that was never written takes no room, and its shape has been held against the others'.
    if size > MOST_COMPRESSION * stored and not (known and stored == 0):
        raise InputError(
            f"{dataset.name} claims {size} bytes, and the file stores {stored} of them;"
            " it is damaged, make it again"
        )
    if item.units is None:
        return None if item.kind == "bits" else 1.0
    try:
        return factor(item.units, text_attribute(dataset, "units"))
    except InputError as error:
        raise InputError(f"{dataset.name}: {error}") from None


def _read(dataset: Any, scale: float | None) -> npt.NDArray[Any]:
    if scale is None:
        return np.asarray(dataset[()]).astype(np.uint32, copy=False)
    values = np.asarray(dataset[()], dtype=np.float64)
    if scale != 1.0:
        values *= scale
    values.flags.writeable = False
    return values


def text_attribute(item: Any, name: str, missing: str = "") -> str:
    """Return an attribute that is a text, `missing` where there is none or it is something else."""
    value = item.attrs.get(name, missing)
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return value if isinstance(value, str) else missing


def text_list_attribute(item: Any, name: str) -> list[str]:
    """Return an attribute that is a list of texts.

    Raises
    ------
    InputError
        It is missing or something else.
    """
    value = item.attrs.get(name)
    texts = [v.decode("utf-8", "replace") if isinstance(v, bytes) else v for v in np.ravel(value).tolist()]
    if not texts or not all(isinstance(text, str) for text in texts):
        raise InputError(f"{item.name} has no list of {name}; the file is damaged, make it again")
    return texts


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
        raise InputError(f"{dataset.name} is no text; the file is damaged, make it again")
    value = dataset[()]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)

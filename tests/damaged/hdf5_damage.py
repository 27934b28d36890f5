"""Damage to what an HDF5 file says, made with HDF5 itself: its own bookkeeping stays sound."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from clbrdf.storage.seal import seal

UNITS = ("um", "rad", "furlong", "", "%", "1/sr", "nm", "deg")
ATTRIBUTES: tuple[Any, ...] = (
    np.arange(3),
    "x" * 5000,
    np.bytes_(b"\xff\xfe\x00"),
    np.nan,
    2**63 - 1,
    -1,
    np.zeros(0),
    h5py.Empty("f8"),
    ["a", "b"],
    np.array([1 + 2j]),
    True,
)
VALUES = (np.nan, np.inf, -1.0, 0.0, 1e300, -1e300, 5e-324, 2.0**31, 91.0)
TYPES = ("f4", "f8", "i1", "u1", "i8", "u8", "c8", "c16", "f2", "?", "S3", "longdouble")

MOST_VALUES = 1 << 20
"""Of an array that is changed value by value: an earlier change may have made one that claims 2**62."""


def damage(path: Path, rng: np.random.Generator, sealed: bool) -> None:
    """Change one to three things in a file; seal it again where it is to pass for ours."""
    with h5py.File(path, "a", libver=("earliest", "latest")) as file:
        for _ in range(rng.integers(1, 4)):
            names: list[str] = []
            file.visit(names.append)
            name = str(names[rng.integers(len(names))]) if names and rng.random() < 0.97 else "/"
            try:
                _one(file, name, rng)
            except (KeyError, OSError, RuntimeError, TypeError, ValueError):
                continue  # HDF5 does not do this to what an earlier change has left
    if sealed:
        seal(path)


def _one(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    item = file[name]
    kind = rng.integers(8)
    if kind >= 6 or name == "/":
        _attribute(item, rng)
    elif kind == 0:
        del file[name]
    elif kind == 1:
        attributes = dict(item.attrs)
        del file[name]
        _replace(file, name, attributes, rng)
    elif isinstance(item, h5py.Dataset) and item.size is not None and item.size < MOST_VALUES:
        _array(file, name, rng, int(kind))
    else:
        _attribute(item, rng)


def _attribute(item: Any, rng: np.random.Generator) -> None:
    names = list(item.attrs)
    if "units" in names and rng.random() < 0.5:
        item.attrs["units"] = UNITS[rng.integers(len(UNITS))]
    elif names:
        key = names[rng.integers(len(names))]
        if rng.random() < 0.3:
            del item.attrs[key]
        else:
            item.attrs[key] = ATTRIBUTES[rng.integers(len(ATTRIBUTES))]


def _replace(file: h5py.File, name: str, attributes: dict[str, Any], rng: np.random.Generator) -> None:
    kind = rng.integers(11)
    if kind == 0:
        file.create_group(name)
    elif kind == 1:
        file[name] = h5py.SoftLink("/" if rng.random() < 0.5 else "/" + name)
    elif kind == 2:
        file[name] = h5py.ExternalLink("/etc/passwd", "/")
    elif kind == 3:
        file.create_dataset(name, shape=(2**31,), dtype="f8", chunks=(1 << 16,))
    elif kind == 4:
        file.create_dataset(name, shape=(2**31, 2**31), dtype="u4", chunks=(64, 64))
    elif kind == 5:
        file[name] = ["text", "other"]
    elif kind == 6:
        file[name] = np.bytes_(b"\xff\xfe text \x80")
    elif kind == 7:
        file[name] = np.zeros(3, [("r", "f8"), ("t", "S4")])
    elif kind == 8:
        file.create_dataset(name, data=h5py.Empty("f8"))
    elif kind == 9:
        file.create_dataset(name, (2,), h5py.ref_dtype)
    else:
        file.create_dataset(name, (3,), h5py.vlen_dtype("f8"))
    if kind not in (1, 2):
        for key, value in attributes.items():
            file[name].attrs[key] = value


def _array(file: h5py.File, name: str, rng: np.random.Generator, kind: int) -> None:
    item = file[name]
    values, attributes = item[()], dict(item.attrs)
    numeric = getattr(values, "dtype", np.dtype("O")).kind in "fiub"
    if not numeric:
        new: Any = ["x" * 3000] if rng.random() < 0.5 else 7.0
    elif kind == 2:
        with np.errstate(all="ignore"):
            new = np.asarray(values).astype(TYPES[rng.integers(len(TYPES))])
    elif kind == 3:
        array = np.asarray(values)
        new = [array.T, array[:-1] if array.ndim else [array], np.ravel(array), array[None]][rng.integers(4)]
    else:
        new = np.array(values, dtype=np.float64 if kind == 4 else None)
        with np.errstate(all="ignore"):
            worst = np.array(VALUES[rng.integers(len(VALUES))]).astype(new.dtype)
        if new.size:
            new.flat[rng.integers(new.size)] = worst
    del file[name]
    file[name] = new
    for key, value in attributes.items():
        file[name].attrs[key] = value

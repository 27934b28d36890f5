"""Several scans in one file, each an entry by its name."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.scan.record import Scan
from clbrdf.scan.told import title_of
from clbrdf.storage import hdf5
from clbrdf.storage.files import split_entry


def save_scans(path: str | Path, scans: Mapping[str, Scan], overwrite: bool = False) -> None:
    """Write scans by name into one NeXus HDF5 file, an NXentry each, whole or not at all.

    Raises
    ------
    InputError
        No scans; a name that HDF5 or the command line cannot take; the file exists and `overwrite` is
        False, or it cannot be written.
    """
    for name in scans:
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*", name):
            raise InputError(f"{name!r} is no name for a scan in a file; take letters, digits and _ . + -")
    if not scans:
        raise InputError(f"{path}: no scan to write")
    first, *others = scans
    with hdf5.create_file(path, "scan", title_of(scans[first]), overwrite, first) as file:
        scans[first].write(file[first])
        for name in others:
            scans[name].write(hdf5.add_entry(file, name, title_of(scans[name])))


def open_scans(path: str | Path) -> dict[str, Scan]:
    """Read all scans of a file, by name; of a path like ``file.h5::name`` that one.

    Raises
    ------
    InputError
        As `Scan.open`.
    """
    with hdf5.open_file(path) as file:
        names = hdf5.entry_names(file)
        if len(names) <= 1 or split_entry(path)[1]:
            names = []
    source = split_entry(path)[0]
    if not names:
        return {split_entry(path)[1] or "entry": Scan.open(path)}
    return {name: Scan.open(f"{source}::{name}") for name in names}

"""Files of any known format, read into scans."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError, advice
from clbrdf.formats.guard import Decision, Options, decide
from clbrdf.formats.reading import Reading
from clbrdf.formats.registry import Format, find_format, formats, get_format
from clbrdf.formats.wide import is_wide
from clbrdf.scan import Scan


@dataclass(frozen=True)
class Loaded:
    """What files held.

    Attributes
    ----------
    scans : mapping of str to Scan
        By a name that a file can have.
    decisions : mapping of str to tuple of Decision
        How the conventions of each scan were taken; of several files, those of the first.
    notes : mapping of str to tuple of str
        What readers left out or took for granted.
    formats : tuple of str
        Of each file.
    """

    scans: Mapping[str, Scan]
    decisions: Mapping[str, tuple[Decision, ...]]
    notes: Mapping[str, tuple[str, ...]]
    formats: tuple[str, ...]


def load(
    paths: Sequence[str | Path],
    *,
    format_name: str | None = None,
    sample: str | None = None,
    options: Options | None = None,
    names: Mapping[str, str] | None = None,
) -> Loaded:
    """Read files: each sample becomes one scan, joined over all files.

    Parameters
    ----------
    paths : sequence of path
        Files of one measurement, such as one a wavelength or one an incident angle.
    format_name : str, optional
        Of all of them; by content if not given.
    sample : str, optional
        The sample to take.
    options : Options, optional
        Conventions that the user settles.
    names : mapping of str to str, optional
        Headings of a table, and the names that they stand for, such as "Angle in": "theta_i_deg".

    Raises
    ------
    InputError
        A file that cannot be read, conventions that cannot be settled, no such sample, or samples of
        several files that do not belong together.
    """
    if not paths:
        raise InputError("no file to read")
    places = [Path(path).resolve() for path in paths]
    for place, path in zip(places, paths, strict=True):
        if places.count(place) > 1:
            raise InputError(f"{path} is given twice; its values would count as repeats")
    parts: dict[str, list[tuple[Scan, tuple[Decision, ...], tuple[str, ...]]]] = {}
    kinds: list[str] = []
    readings: list[tuple[Path, str, Reading]] = []
    for path in map(Path, paths):
        each = _format_of(path, format_name, names)
        kinds.append(each.name)
        # What is not finite is flagged in the end; arithmetic with it is no news.
        with np.errstate(all="ignore"):
            readings += [
                (path, each.title, reading)
                for reading in (each.read(path, names) if names else each.read(path))
            ]
    listed = list(dict.fromkeys(reading.sample for _, _, reading in readings))
    if sample is not None and sample not in listed:
        where = ", ".join(str(path) for path in paths)
        there = "the file names no samples" if listed == [""] else f"there are {_quoted(listed)}"
        raise InputError(f"{where}: no sample is called {sample!r}; {there}")
    # One sample a file: files are parts of one measurement, whatever each calls it.
    one_each = len(readings) == len(paths)
    for path, title, reading in readings:
        if sample is not None and reading.sample != sample:
            continue
        try:
            with np.errstate(all="ignore"):
                scan, decisions = decide(str(path), reading, options)
        except InputError as error:
            # What a scan refuses by itself, such as an infinite uncertainty, does not know its file.
            raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error
        provenance = {"input": path.name, "format": title, **scan.provenance}
        key = "" if one_each else reading.sample
        parts.setdefault(key, []).append((replace(scan, provenance=provenance), decisions, reading.notes))
    scans: dict[str, Scan] = {}
    said: dict[str, tuple[Decision, ...]] = {}
    notes: dict[str, tuple[str, ...]] = {}
    for several in parts.values():
        name = _unique(_file_name(several[0][0].sample or Path(paths[0]).stem), scans)
        scans[name] = _merged(paths, [scan for scan, _, _ in several])
        said[name] = several[0][1]
        notes[name] = tuple(dict.fromkeys(note for _, _, own in several for note in own))
    return Loaded(scans, said, notes, tuple(kinds))


def _format_of(path: Path, name: str | None, names: Mapping[str, str] | None) -> Format:
    """Return the format of a file; with names for its headings it is a table.

    Raises
    ------
    InputError
        A format without headings, or none that is known.
    """
    if not names:
        return get_format(name) if name else find_format(path)
    tables = [each for each in formats().values() if each.maps_names]
    if name is None:
        # The one that takes the headings under their new names; else the last says what is missing.
        wide, long = tables
        return wide if is_wide(path, names) else long
    if get_format(name) not in tables:
        listed = " or ".join(each.name for each in tables)
        raise InputError(
            f"{path}: {advice('names', '--map')} is for columns of a table, and {name} has none; leave it out"
            f" or take {listed}"
        )
    return get_format(name)


def load_one(paths: Sequence[str | Path], sample: str | None = None, options: Options | None = None) -> Scan:
    """Read files that hold one scan, or the one of a sample; see `load`.

    Raises
    ------
    InputError
        As `load`; also several samples and none chosen.
    """
    loaded = load(paths, sample=sample, options=options)
    if len(loaded.scans) > 1:
        listed = list(dict.fromkeys(scan.sample for scan in loaded.scans.values()))
        where = ", ".join(str(path) for path in paths)
        option = advice("sample", "--sample")
        raise InputError(f"{where}: holds {len(listed)} samples; choose one with {option}: {_quoted(listed)}")
    return next(iter(loaded.scans.values()))


def _merged(paths: Sequence[str | Path], scans: Sequence[Scan]) -> Scan:
    if len(scans) == 1:
        return scans[0]
    try:
        return Scan.merge(scans)
    except InputError as error:
        raise InputError(f"{', '.join(str(path) for path in paths)}: {error}") from error


def _file_name(text: str) -> str:
    """Return a text as a name in a file: letters, digits and _ . + -."""
    plain = re.sub(r"[^A-Za-z0-9_.+-]+", "_", text).strip("_.+-")
    return plain[:80] or "scan"


def _unique(name: str, taken: Mapping[str, object]) -> str:
    if name not in taken:
        return name
    return next(other for k in range(2, len(taken) + 3) if (other := f"{name}_{k}") not in taken)


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names)

"""Results appear whole or not at all."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from clbrdf.errors import InputError, advice
from clbrdf.parallel.ending import undone_at_end

TRIED = 4096
"""Bytes written to see whether a file can be: a full disk takes a name, and no bytes."""


def split_entry(path: str | Path) -> tuple[Path, str]:
    """Split ``file.h5::name`` into the file and the name of an entry in it, "" where none is named.

    A file that has "::" in its own name is taken as it is.
    """
    whole = Path(path)
    before, marker, name = str(whole).rpartition("::")
    if not marker or not before or whole.exists():
        return whole, ""
    return Path(before), name


def check_output(path: str | Path, overwrite: bool) -> Path:
    """Return where a result goes, as a Path; called before the work starts.

    Raises
    ------
    InputError
        The file exists and may not be replaced, is a folder or a device, or nothing can be written to its
        folder: it does not exist, is protected, or its disk is full.
    """
    target = Path(path)
    try:
        if target.is_symlink():
            target = Path(os.path.realpath(target))
        target.exists()
    except OSError as error:  # a name that is too long
        raise InputError(f"{target}: cannot be written ({error.strerror}); choose another name") from error
    if target.is_symlink():  # where real paths end, none is left
        raise InputError(f"{target}: cannot be written (its links lead in a circle); choose another name")
    if target.exists() and not (target.is_file() or target.is_dir()):
        raise InputError(f"{target}: is a device or a pipe; name a file")
    if target.is_dir():
        raise InputError(f"{target}: is a folder; name a file in it")
    if target.exists() and not overwrite:
        raise _existing(target)
    if not target.parent.is_dir():
        raise InputError(f"{target}: the folder {target.parent} does not exist; create it first")
    _try_out(target)
    return target


def _try_out(target: Path) -> None:
    """Write a little beside a file and remove it again; raise InputError where that fails."""
    part = _part_of(target)
    try:
        part.write_bytes(bytes(TRIED))
    except OSError as error:
        raise _unwritten(target, error) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def _part_of(target: Path) -> Path:
    """Return the name under which a file is written before it is whole."""
    return target.with_name(f".{target.name}.{os.getpid()}.part")


def _unwritten(target: Path, error: OSError) -> InputError:
    mends = {
        errno.ENOSPC: "free some space, or choose another disk",
        errno.EDQUOT: "free some space, or choose another disk",
        errno.EFBIG: "files of this size are not allowed here; choose another disk",
        errno.ENAMETOOLONG: "choose a shorter name",
    }
    mend = mends.get(error.errno or 0, "choose another folder")
    return InputError(f"{target}: cannot be written ({error.strerror or error}); {mend}")


def _existing(target: Path) -> InputError:
    add = advice("give overwrite=True", "add --overwrite")
    return InputError(f"{target}: exists already; choose another name or {add}")


def check_apart(outputs: Iterable[str | Path | None], inputs: Iterable[str | Path] = ()) -> None:
    """Raise InputError where two outputs are one file, or an output is an input."""
    seen = {split_entry(path)[0].resolve() for path in inputs}
    for path in outputs:
        if path is None:
            continue
        if Path(path).resolve() in seen:
            raise InputError(f"{path}: is another file of this command, too; name one of its own")
        seen.add(Path(path).resolve())


@contextmanager
def whole_file(path: str | Path, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary name beside `path`; it is renamed to `path` if the block ends well, else deleted.

    Raises
    ------
    InputError
        As `check_output`, or the folder cannot be written.
    """
    target = check_output(path, overwrite)
    part = _part_of(target)
    with undone_at_end(lambda: part.unlink(missing_ok=True)):
        yield from _filled(part, target, overwrite)


def _filled(part: Path, target: Path, overwrite: bool) -> Iterator[Path]:
    try:
        yield part
        with open(part, "rb") as stream:
            os.fsync(stream.fileno())
        if overwrite:
            os.replace(part, target)
        else:
            os.link(part, target)  # unlike a rename, it never replaces a file that came meanwhile
    except FileExistsError as error:
        raise _existing(target) from error
    except OSError as error:
        raise _unwritten(target, error) from error
    finally:
        part.unlink(missing_ok=True)


def whole_text(path: str | Path, content: Mapping[str, object] | str, overwrite: bool = False) -> None:
    """Write a text, or a mapping as JSON (NaN becomes null), whole or not at all.

    Raises
    ------
    InputError
        As `whole_file`.
    """
    text = (
        content if isinstance(content, str) else json.dumps(_plain(content), indent=1, allow_nan=False) + "\n"
    )
    with whole_file(path, overwrite) as part:
        part.write_text(text, encoding="utf-8")


def _plain(value: object) -> object:
    """Replace what JSON has no word for, NaN and ±∞, by null."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def sha256(path: str | Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal; of the whole file also where the path names an entry."""
    with open(split_entry(path)[0], "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

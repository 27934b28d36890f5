"""What a command writes into a file about itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from clbrdf import __version__
from clbrdf.storage.files import sha256


def made_by(
    command: str, inputs: Iterable[Path], options: Mapping[str, object], given: Mapping[str, str]
) -> dict[str, str]:
    """Return the provenance of a result: version, command, hashes of inputs, then what is `given`.

    The command names what determines the result, not where the result went, so that the same work leaves
    the same bytes. Options that are None or empty are left out.
    """
    files = list(inputs)
    words = ["clbrdf", command, *(path.name for path in files)]
    for name, value in options.items():
        values = value if isinstance(value, list) else [value]
        words += [f"--{name} {item}" for item in values if item is not None]
    hashes = {f"input_{k}_sha256": sha256(path) for k, path in enumerate(files)}
    return {"version": __version__, "command": " ".join(words), **hashes, **given}

"""What a command writes into a file about itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from clbrdf.storage.files import sha256
from clbrdf.version import __version__


@dataclass(frozen=True)
class Input:
    """A file that a result was made of, by its name and hash; it need not be on this machine."""

    name: str
    sha256: str

    @classmethod
    def of(cls, path: Path) -> Input:
        """Return the record of a file that is here."""
        return cls(path.name, sha256(path))


def made_by(
    command: str, inputs: Iterable[Path | Input], options: Mapping[str, object], given: Mapping[str, str]
) -> dict[str, str]:
    """Return the provenance of a result: version, command, hashes of inputs, then what is `given`.

    The command names what determines the result, not where the result went, so that the same work leaves
    the same bytes. Options that are None or empty are left out; those that are True are named alone.
    """
    files = [Input.of(file) if isinstance(file, Path) else file for file in inputs]
    words = ["clbrdf", command, *(file.name for file in files)]
    for name, value in options.items():
        values = value if isinstance(value, list) else [value]
        words += [f"--{name}" if item is True else f"--{name} {item}" for item in values if item is not None]
    hashes = {f"input_{k}_sha256": file.sha256 for k, file in enumerate(files)}
    return {"version": __version__, "command": " ".join(words), **hashes, **given}


def fit_options(
    *,
    method: str,
    seed: int,
    weights: str,
    bounds: Sequence[str],
    model: str,
    fix: Sequence[str],
    shared: Sequence[str],
    smooth: float | None,
    rtol: float | None,
    through: str | None = None,
    point: bool = False,
    monte_carlo: int | None = None,
    gls: bool = False,
    profile: bool = False,
) -> dict[str, object]:
    """Return the options of `clbrdf fit` in the order in which a fit file names them."""
    options = {"method": method, "seed": seed, "weights": weights, "bounds": list(bounds), "model": model}
    return options | {
        "fix": list(fix) or None,
        "shared": list(shared) or None,
        "smooth": smooth,
        "rtol": rtol,
        "through": through,
        "point": point or None,
        "monte-carlo": monte_carlo,
        "gls": gls or None,
        "profile": profile or None,
    }


def choose_options(
    *,
    models: str | None,
    weights: str | None,
    fix: Sequence[str],
    wavelengths: str,
    method: str,
    seed: int,
    force: bool,
    through: str | None = None,
    point: bool = False,
) -> dict[str, object]:
    """Return the options of `clbrdf choose` in the order in which a fit file names them."""
    options: dict[str, object] = {"models": models, "weights": weights, "fix": list(fix)}
    return options | {
        "wavelengths": wavelengths,
        "method": method,
        "seed": seed,
        "force": force or None,
        "through": through,
        "point": point or None,
    }

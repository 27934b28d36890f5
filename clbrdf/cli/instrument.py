"""What --through and --point of `clbrdf fit` and `clbrdf choose` come to."""

from __future__ import annotations

from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.fit.through import POINT, SCAN


def told_instrument(through: Path | None, point: bool) -> str | Path:
    """Return what --through and --point tell a fit of its instrument.

    Raises
    ------
    InputError
        Both are given.
    """
    if point and through is not None:
        raise InputError("--point and --through say two things of the instrument; give one of them")
    return POINT if point else SCAN if through is None else through

"""ASAM OpenMATERIAL 3D look-up table `.xompt` (JSON): rows [λ in m, θi, θo, Δφ, f], angles in radians.

Whether Δφ = 0 is the side of the source or the forward one is settled by neither file nor standard text.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.bird import load_json
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.table import long_reading

Array = npt.NDArray[np.float64]

ROW = 5


def sniff(head: Head) -> int:
    """Return whether it is JSON of OpenMATERIAL, or a file of its ending."""
    text = head.text.lstrip("\ufeff \t\r\n")
    named = "openmaterial" in text or head.path.suffix.casefold() == ".xompt"
    return SURE if text.startswith("{") and named and '"theta_r"' not in text else NO


def read(path: Path) -> list[Reading]:
    """Read an OpenMATERIAL table.

    Raises
    ------
    InputError
        No list of rows of five numbers, or rows of another length among them.
    """
    content = load_json(path)
    rows = _find_rows(content)
    if rows is None:
        raise InputError(f"{path}: no list of rows of {ROW} numbers, [λ, θi, θo, Δφ, f]")
    bad = next((k for k, row in enumerate(rows) if not isinstance(row, list) or len(row) != ROW), None)
    if bad is not None:
        raise InputError(f"{path}: row {bad + 1} has not {ROW} values, [λ, θi, θo, Δφ, f]")
    try:
        table = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path}: the rows hold something else than numbers") from None
    metres, theta_i, theta_r, phi, values = table.T
    waves, back = np.unique(metres * 1e9, return_inverse=True)
    metadata = content.get("metadata")
    name = metadata.get("name", "") if isinstance(metadata, dict) else ""
    return [
        long_reading(
            path, np.stack([theta_i, np.zeros(len(table)), theta_r, phi], axis=1), values,
            np.asarray(back.reshape(-1), dtype=np.intp), waves, (),
            Stated(angle="rad", forward=None, sure=frozenset({"angle", "length", "origin"})),
            sample=name if isinstance(name, str) else "", extra=_solid_angle(content),
        )
    ]  # fmt: skip


def _find_rows(item: Any, depth: int = 0) -> list[Any] | None:
    """Return the first list whose first element is a row of five numbers."""
    if isinstance(item, list) and item and isinstance(item[0], list):
        first = item[0]
        if len(first) == ROW and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in first):
            return item
    if depth > 8:
        return None
    children = item.values() if isinstance(item, dict) else item[:16] if isinstance(item, list) else ()
    return next((found for child in children if (found := _find_rows(child, depth + 1)) is not None), None)


def _solid_angle(item: Any) -> dict[str, float]:
    """Return the solid angle of the receiver where the file gives one for all rows, sr."""
    found = item.get("receiverSolidAngles", item.get("data")) if isinstance(item, dict) else None
    if isinstance(found, dict):
        found = found.get("receiverSolidAngles")
    values: list[Any] = found if isinstance(found, list) else [found]
    kinds = {float(v) for v in values if isinstance(v, (int, float)) and not isinstance(v, bool)}
    return {"solid_angle": kinds.pop()} if len(kinds) == 1 and min(kinds) > 0.0 else {}


FORMAT = Format("openmaterial", "ASAM OpenMATERIAL 3D .xompt", (".xompt",), sniff, read)

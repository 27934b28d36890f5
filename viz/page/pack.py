"""Arrays as text for a page: base64 of their little-endian bytes."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

KINDS = {"f8": "<f8", "f4": "<f4", "u1": "u1", "i4": "<i4"}
"""Names of number types as viz/page/data.js knows them."""


def packed(values: npt.ArrayLike, kind: str = "f8") -> dict[str, Any]:
    """Return an array as a mapping that JSON takes: kind, shape and bytes."""
    array = np.ascontiguousarray(values, dtype=KINDS[kind])
    return {"kind": kind, "shape": list(array.shape), "bytes": base64.b64encode(array.tobytes()).decode()}


def packed_angles(values: npt.NDArray[np.float64]) -> dict[str, Any]:
    """Return angles in single precision where that loses nothing, in double elsewhere."""
    exact = np.array_equal(values.astype(np.float32).astype(np.float64), values)
    return packed(values, "f4" if exact else "f8")

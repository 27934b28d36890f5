"""How wide the kernels of a device are: safe widths, and what tuning has found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np

from clbrdf.opencl.answers import keep_answer, read_answer
from clbrdf.opencl.device import Device

MEASURED = ("objectives.cl", "models/wang2013.cl")
"""Files that tuning measures beside kernels/lib."""


@dataclass(frozen=True)
class Lanes:
    """Shape of a kernel.

    Attributes
    ----------
    width : int
        Vector lanes of a work item: 1, 2, 4, 8 or 16.
    unroll : int
        Directions that a sum takes side by side.
    """

    width: int
    unroll: int

    def __str__(self) -> str:
        return f"{self.width} lanes × {self.unroll}"


def safe_lanes(device: Device, dtype: type[np.floating]) -> Lanes:
    """Return lanes that every known compiler survives: 1 on a GPU, 32 bytes on a CPU.

    Wider vectors crash or hang the compiler of the PoCL that the wheel brings on AVX-512 machines.
    """
    return Lanes(1, 1) if device.kind == "gpu" else Lanes(32 // np.dtype(dtype).itemsize, 8)


def lanes_of(device: Device, dtype: type[np.floating]) -> Lanes:
    """Return the tuned lanes of a device, or the safe ones where it has not been tuned."""
    return read_answers(device).get(np.dtype(dtype).name, safe_lanes(device, dtype))


def read_answers(device: Device) -> dict[str, Lanes]:
    """Return the tuned lanes of a device by the name of the type; {} where it has not been tuned."""
    try:
        return {
            name: Lanes(int(row["width"]), int(row["unroll"]))
            for name, row in read_answer(device, "lanes", _measured()).items()
        }
    except (KeyError, TypeError, ValueError):
        return {}


def keep_answers(device: Device, answers: dict[str, Lanes]) -> Path:
    """Keep tuned lanes of a device; return the file."""
    rows = {name: {"width": lanes.width, "unroll": lanes.unroll} for name, lanes in answers.items()}
    return keep_answer(device, "lanes", rows, _measured())


@cache
def _measured() -> str:
    """Return the kernels that tuning measures (`clbrdf.bench.tune`): E of the default model."""
    root = resources.files("clbrdf.kernels")
    return "".join(root.joinpath(name).read_text(encoding="utf-8") for name in MEASURED)

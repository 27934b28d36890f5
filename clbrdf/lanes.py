"""How wide the kernels of a device are: safe widths, and the answers of tuning kept on disk.

An answer belongs to a device, its driver and the kernel sources; when one of them changes it is no
longer found, and the safe width is used until the device is tuned again.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np

from clbrdf.device import Device
from clbrdf.files import whole_text


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
    return Lanes(1, 1) if device.kind == "gpu" else Lanes(32 // np.dtype(dtype).itemsize, 4)


def lanes_of(device: Device, dtype: type[np.floating]) -> Lanes:
    """Return the tuned lanes of a device, or the safe ones where it has not been tuned."""
    return read_answers(device).get(np.dtype(dtype).name, safe_lanes(device, dtype))


@cache
def read_answers(device: Device) -> dict[str, Lanes]:
    """Return the answers kept for a device by the name of the type; {} where there are none."""
    try:
        content = json.loads(_answer_file(device).read_text(encoding="utf-8"))
        return {name: Lanes(int(row["width"]), int(row["unroll"])) for name, row in content["lanes"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def keep_answers(device: Device, answers: dict[str, Lanes]) -> Path:
    """Keep answers for a device; return the file."""
    path = _answer_file(device)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = {name: {"width": lanes.width, "unroll": lanes.unroll} for name, lanes in answers.items()}
    whole_text(path, {"device": str(device), "driver": device.driver, "lanes": rows}, overwrite=True)
    read_answers.cache_clear()
    return path


def _answer_file(device: Device) -> Path:
    import platformdirs

    folder = os.environ.get("CLBRDF_CACHE_DIR") or platformdirs.user_cache_path("clbrdf")
    key = "\n".join((device.name, device.platform, device.version, device.driver, _sources_digest()))
    return Path(folder) / f"lanes-{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"


@cache
def _sources_digest() -> str:
    digest = hashlib.sha256()
    for folder in ("lib", "models"):
        for entry in sorted(
            resources.files("clbrdf.kernels").joinpath(folder).iterdir(), key=lambda e: e.name
        ):
            digest.update(entry.read_bytes())
    return digest.hexdigest()

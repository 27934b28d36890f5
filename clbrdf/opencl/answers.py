"""What was measured on a device once, kept on disk.

An answer belongs to a device, its driver and the kernels that were measured; when one of them changes it is
no longer found, and has to be measured again. The arithmetic in kernels/lib is part of every answer.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from clbrdf.opencl.device import Device
from clbrdf.storage.files import whole_text


@cache
def read_answer(device: Device, topic: str, kernels: str = "") -> Mapping[str, Any]:
    """Return what is kept for a device on a topic, {} where there is nothing or it is damaged.

    `kernels` is the text of what was measured, beside kernels/lib.
    """
    try:
        content = json.loads(_file(device, topic, kernels).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    answer = content.get("answer") if isinstance(content, dict) else None
    return answer if isinstance(answer, dict) else {}


def keep_answer(device: Device, topic: str, answer: Mapping[str, Any], kernels: str = "") -> Path:
    """Keep an answer for a device; return the file.

    Raises
    ------
    InputError
        The folder of answers cannot be written.
    """
    path = _file(device, topic, kernels)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"device": str(device), "driver": device.driver, "topic": topic, "answer": dict(answer)}
    whole_text(path, content, overwrite=True)
    read_answer.cache_clear()
    return path


def _file(device: Device, topic: str, kernels: str) -> Path:
    import platformdirs

    folder = os.environ.get("CLBRDF_CACHE_DIR") or platformdirs.user_cache_path("clbrdf")
    key = "\n".join((device.name, device.platform, device.version, device.driver, _library_text(), kernels))
    return Path(folder) / f"{topic}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"


@cache
def _library_text() -> str:
    folder = resources.files("clbrdf.kernels").joinpath("lib")
    files = sorted(folder.iterdir(), key=lambda entry: entry.name)
    return "".join(entry.read_text(encoding="utf-8") for entry in files if entry.name.endswith(".cl"))

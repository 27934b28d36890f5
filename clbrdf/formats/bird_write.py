"""Writing."""

from __future__ import annotations

from pathlib import Path

from clbrdf.scan import Scan


def write(scan: Scan, path: Path) -> None:
    """Write."""

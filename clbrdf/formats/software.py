"""What files say wrote them."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    VERSION = version("clbrdf")
except PackageNotFoundError:  # run from a source tree that is not installed
    VERSION = "unknown"

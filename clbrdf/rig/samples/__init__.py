"""Sample files of the rig: rig.toml, plan.toml, budget.toml; they work as they are with the emulator."""

from __future__ import annotations

from pathlib import Path


def sample_path(name: str) -> Path:
    """Return the path of a sample file, such as "rig.toml"."""
    return Path(__file__).with_name(name)

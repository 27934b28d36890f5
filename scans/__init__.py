"""Small sample scans, and the scenes that made them."""

from pathlib import Path


def sample_scan(name: str) -> Path:
    """Return the path of a sample scan, "yellow_tin_foil" or "black_ceramic_tile" (both synthetic)."""
    return Path(__file__).with_name(f"{name}.h5")


def sample_scene(name: str) -> Path:
    """Return the path of the scene file that a sample scan was made from."""
    return Path(__file__).with_name(f"{name}.toml")

"""Small sample scans, and what made them."""

from pathlib import Path


def sample_scan(name: str) -> Path:
    """Return the path of a sample scan, "yellow_tin_foil" or "black_ceramic_tile" (both synthetic)."""
    return Path(__file__).with_name(f"{name}.h5")

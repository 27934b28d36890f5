"""Weights that take a spectrum to colour under two illuminants, for a page."""

from __future__ import annotations

from typing import Any

from clbrdf.colour import colour_weights
from clbrdf.errors import InputError
from clbrdf.scan import Scan
from clbrdf.viz.page.pack import packed

LIGHTS = ("D65", "A")
"""Daylight and incandescent light."""


def colour_record(scan: Scan) -> dict[str, Any]:
    """Return weights (3, W) by illuminant, or why a scan has no colour."""
    if scan.bands:
        return {"missing": "the columns are bands, and a colour needs wavelengths"}
    try:
        return {name: packed(colour_weights(scan.wavelength, name, "colour by value")) for name in LIGHTS}
    except InputError as error:
        return {"missing": str(error)}

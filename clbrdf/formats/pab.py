"""Pab advanced technologies gonio-photometer text: ``#key value`` lines, then rows θ φ value.

``#format: theta phi DSF`` or ``BSDF`` says whether values are multiplied by cosθ; ``#intheta`` and ``#inphi``
are the incident direction, above 90° from behind. Source: the reader of Radiance (pabopto2bsdf).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.text import numbers, read_text

KEY = re.compile(r"#\s*(\w+)\s*:?\s*(.*)")
WAVELENGTH = re.compile(r"(\d+(?:\.\d+)?)\s*nm", re.IGNORECASE)


def sniff(head: Head) -> int:
    """Return whether a line #format names theta and phi."""
    return SURE if re.search(r"^#\s*format:?\s+theta\s+phi\s+(bsdf|dsf)", head.text, re.MULTILINE) else NO


def read(path: Path) -> list[Reading]:
    """Read a pab file.

    Raises
    ------
    InputError
        No incident direction, no #format, rows that are no three (or more) numbers.
    """
    text = read_text(path)
    lines = text.split("\n")
    keys: dict[str, str] = {}
    for line in lines:
        if (match := KEY.match(line.strip())) is not None:
            keys.setdefault(match.group(1).casefold(), match.group(2).strip())
    kind = re.fullmatch(r"theta\s+phi\s+(BSDF|DSF)\b.*", keys.get("format", ""), re.IGNORECASE)
    if kind is None:
        raise InputError(f"{path}: no line '#format: theta phi BSDF' (or DSF) says what the values are")
    try:
        theta_in, phi_in = float(keys["intheta"]), float(keys.get("inphi", "0"))
    except (KeyError, ValueError):
        raise InputError(f"{path}: no line '#intheta 30' gives the incident zenith") from None
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise InputError(f"{path}: no rows of values after the header")
    width = len(rows[0].replace(",", " ").split())
    flat = numbers(path, "\n".join("" if line.lstrip().startswith("#") else line for line in lines))
    if width < 3 or len(flat) % width:
        raise InputError(f"{path}: rows of {width} numbers, {len(flat)} in all; they are θ φ value")
    table = flat.reshape(-1, width)
    behind = theta_in > 90.0
    theta = 180.0 - table[:, 0] if behind else table[:, 0]
    tristimulus = width == 5 and "xyz" in keys.get("colorimetry", "").casefold()
    nm = WAVELENGTH.findall(keys.get("colorimetry", "") + " " + keys.get("wavelength", ""))
    spectrum = np.array([float(nm[0])]) if len(nm) == 1 and width == 3 else np.empty(0)
    bands = ("X", "Y", "Z") if tristimulus else tuple(f"channel {k + 1}" for k in range(width - 2))
    if width == 3:
        bands = (keys.get("colorimetry", "") or "monochrome",)
    sample = keys.get("sample_name", "").strip("\"' ")
    n = len(table)
    return [
        Reading(
            np.full(n, 180.0 - theta_in if behind else theta_in),
            np.full(n, phi_in),
            theta,
            table[:, 1].copy(),
            np.ascontiguousarray(table[:, 2:]),
            spectrum,
            () if len(spectrum) else bands,
            Stated(cosine=kind.group(1).casefold() == "dsf", sure=frozenset({"angle", "origin"})),
            sample=f"{sample} back".strip() if behind else sample,
            notes=("lit from behind: zeniths are counted from the back",) if behind else (),
        )
    ]


FORMAT = Format("pab", "pab gonio-photometer text", (".pab",), sniff, read)

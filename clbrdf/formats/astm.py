"""ASTM E1392 text: keywords, the names of the columns, then comma rows; angles in radians.

``KEY value`` lines, ``VARS theta_i,phi_i,theta_s,phi_s,400nm,…`` (or names of bands), then rows in any order,
1/sr without cosine. Files of the Light Tec dialect name one column less than they have: phi_s is missing.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from clbrdf.errors import InputError
from clbrdf.formats.astm_write import write
from clbrdf.formats.headings import spectrum_of
from clbrdf.formats.reading import SURE as ALL
from clbrdf.formats.reading import Reading, Stated
from clbrdf.formats.registry import NO, SURE, Format, Head
from clbrdf.formats.text import numbers, read_text, take

ANGLES = {"theta_i": 0, "phi_i": 1, "theta_s": 2, "theta_r": 2, "phi_s": 3, "phi_r": 3}


def sniff(head: Head) -> int:
    """Return whether a line VARS names columns."""
    return SURE if re.search(r"^vars\s+theta_i", head.text.replace("\r", "\n"), re.MULTILINE) else NO


def read(path: Path) -> list[Reading]:
    """Read an ASTM E1392 file.

    Raises
    ------
    InputError
        No VARS line, a column missing, rows of another length, another number of rows than NUM_POINTS.
    """
    text = read_text(path)
    match = re.search(r"^VARS[ \t]+(.*)$", text, re.MULTILINE | re.IGNORECASE)
    if match is None:
        raise InputError(f"{path}: no line VARS names the columns")
    keys = dict(
        line.split(None, 1) for line in text[: match.start()].split("\n") if len(line.split(None, 1)) == 2
    )
    names = [name.strip() for name in match.group(1).split(",")]
    body = text[match.end() :]
    first_line = text[: match.end()].count("\n") + 1
    row = next((line for line in body.split("\n") if line.strip()), "")
    width = len(row.replace(",", " ").split())
    notes = []
    if width == len(names) + 1 and "theta_s" in names and "phi_s" not in names:
        names.insert(names.index("theta_s") + 1, "phi_s")
        notes.append("VARS leaves out phi_s; the column after theta_s is taken for it")
    if width != len(names):
        raise InputError(f"{path}: VARS names {len(names)} columns, and rows have {width}")
    flat = numbers(path, body, first_line)
    if len(flat) % width:
        raise InputError(f"{path}: {len(flat)} values make no whole rows of {width}; the file is cut")
    table = flat.reshape(-1, width)
    if keys.get("NUM_POINTS", "").strip().isdigit():
        take(path, table, int(keys["NUM_POINTS"]), "rows")
    places = {ANGLES[name.casefold()]: k for k, name in enumerate(names) if name.casefold() in ANGLES}
    if len(places) < 4:
        raise InputError(f"{path}: VARS needs theta_i, phi_i, theta_s and phi_s; it names {', '.join(names)}")
    others = [k for k in range(width) if k not in places.values()]
    if not others:
        raise InputError(f"{path}: VARS names no column of values")
    spectrum, bands = spectrum_of(path, [names[k] for k in others])
    return [
        Reading(
            table[:, places[0]],
            table[:, places[1]],
            table[:, places[2]],
            table[:, places[3]],
            np.ascontiguousarray(table[:, others]),
            spectrum,
            bands,
            Stated(angle="rad", sure=ALL if keys.get("SOFTWARE", "").startswith("clbrdf") else frozenset()),
            sample=keys.get("SAMPLE_NAME", "").strip(),
            instrument=keys.get("LAB_NAME", "").strip(),
            notes=tuple(notes),
        )
    ]


FORMAT = Format(
    "astm", "ASTM E1392 text, wavelengths or bands", (".astm",), sniff, read, write,
    "any directions, wavelengths or bands, no uncertainties",
)  # fmt: skip

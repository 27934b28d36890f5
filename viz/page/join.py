"""The page's text: its sources, the data and the models' functions in one file."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from html import escape
from importlib import resources
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.models.javascript import javascript_text
from clbrdf.storage.files import whole_text
from clbrdf.viz.page.record import PageSubject, computable, subject_record, with_distinct_names
from clbrdf.viz.page.still import still_html
from clbrdf.viz.page.thin import LARGEST
from clbrdf.viz.style import DIFFERENCE_MAP, VALUE_MAP, colour_table
from clbrdf.viz.subject import Subject

SCRIPTS = (
    "special.js",
    "data.js",
    "angles.js",
    "words.js",
    "surface.js",
    "detector.js",
    "subject.js",
    "state.js",
    "colours.js",
    "scale.js",
    "plot.js",
    "save.js",
    "map.js",
    "raster.js",
    "drag.js",
    "lobe.js",
    "cut.js",
    "spectrum.js",
    "strip.js",
    "live.js",
    "laws.js",
    "tint.js",
    "half.js",
    "slice.js",
    "sphere.js",
    "table.js",
    "controls.js",
    "main.js",
)
"""In the order in which they stand in the page; each may use what earlier ones define."""

MOST_SUBJECTS = 8


def page_text(subjects: Sequence[PageSubject], start: str = "") -> str:
    """Return the page of one or several scans or fits.

    `start` is what is shown where the address says nothing, as the page writes it after #.

    Raises
    ------
    InputError
        None or too many of them, or a fit of transmission.
    """
    if not 0 < len(subjects) <= MOST_SUBJECTS:
        raise InputError(f"a page holds 1 to {MOST_SUBJECTS} files, and here are {len(subjects)}")
    given = with_distinct_names(list(subjects))
    shown = [computable(s) for s in given]
    stills = {s.name: still_html(Subject(s.name, s.scan, s.fit, s.source)) for s in given}
    uncomputed = [stills[s.name] for s, kept in zip(given, shown, strict=True) if s is not kept]
    records = [subject_record(s, LARGEST // len(shown)) for s in shown]
    tables = {
        name: ["#{:02x}{:02x}{:02x}".format(*rgb) for rgb in colour_table(table)]
        for name, table in (("value", VALUE_MAP), ("difference", DIFFERENCE_MAP))
    }
    data = json.dumps(_plain({"subjects": records, "colours": tables, "start": start}), allow_nan=False)
    functions = ",\n".join("null" if s.fit is None else javascript_text(s.fit.model.formula) for s in shown)
    scripts = "\n".join(f"// {name}\n{source(name)}" for name in SCRIPTS)
    title = escape(", ".join(s.name for s in shown))
    parts = {
        "TITLE": title,
        "STYLE": source("page.css"),
        "STILLS": "\n".join(stills.values()),
        "SHOWN": _section(uncomputed),
        "DATA": data.replace("<", "\\u003c"),
        "SCRIPT": f'(() => {{\n"use strict";\n{scripts}\nopenPage([{functions}]);\n}})();',
    }
    return re.sub(r"\{\{([A-Z]+)\}\}", lambda found: parts[found[1]], source("page.html"))


def _section(uncomputed: list[str]) -> str:
    """Return the still pictures of what the page cannot compute, to be seen by everybody."""
    if not uncomputed:
        return ""
    words = "Still pictures of the fits that this page cannot compute; the warnings below say why."
    return (
        f'<section class="stills" aria-label="still pictures"><p>{words}</p>{"".join(uncomputed)}</section>'
    )


def source(name: str) -> str:
    """Return one of the page's own sources."""
    return resources.files("clbrdf.viz.page").joinpath(name).read_text(encoding="utf-8")


def save_page(
    subjects: Sequence[PageSubject], path: str | Path, overwrite: bool = False, start: str = ""
) -> int:
    """Write the page, whole or not at all; return its size in bytes.

    Raises
    ------
    InputError
        As `page_text`, or the file exists or cannot be written.
    """
    text = page_text(subjects, start)
    whole_text(path, text, overwrite)
    return len(text.encode("utf-8"))


def _plain(value: object) -> object:
    """Replace NaN and ±∞, for which JSON has no word, by null."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and value - value != 0.0 else value

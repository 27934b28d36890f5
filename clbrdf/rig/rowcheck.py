"""What the rows of a measurement may say of one another.

A row names others by their numbers: its dark spectrum, the incident power, the next longer integration
time. They were committed before it. −1 names none: a dark has no dark, only points and checks have an
incident power, and a point that was skipped at a limit switch has neither. Where a row is needed, −1 would
be taken for the last one.
"""

from __future__ import annotations

import numpy as np

from clbrdf.errors import InputError
from clbrdf.rig.row import DARK, KINDS, NO_ROW, POINT, REFERENCES, RUNG, SKIPPED
from clbrdf.rig.segment import Columns

LINKS = (("dark", (DARK,)), ("direct", REFERENCES), ("rung", (RUNG,)))
"""Columns that name another row, and of which kinds that is."""

MEND = "the rows are damaged, restore them from a copy"


def check_rows(rows: Columns) -> None:
    """Raise InputError where a row says what no measurement writes; it names the first such row."""
    kind, count = rows["kind"], len(rows["kind"])
    for name, most in (("kind", len(KINDS) - 1), ("scans", np.iinfo(np.uint32).max)):
        least = 0 if name == "kind" else 1
        bad = (rows[name] < least) | (rows[name] > most)
        if bad.any():
            row = int(np.argmax(bad))
            said = f"{name} of row {row} is {rows[name][row]}"
            raise InputError(f"{said}, and {least} to {most} is possible; {MEND}")
    measured = (kind != DARK) & ((rows["flags"] & SKIPPED) == 0)
    needed = {"dark": measured, "direct": measured & (kind == POINT), "rung": np.zeros(count, dtype=np.bool_)}
    for name, kinds in LINKS:
        link = rows[name].astype(np.int64)
        none = link == NO_ROW
        earlier = (link >= 0) & (link < np.arange(count))
        right = earlier & np.isin(kind[np.where(earlier, link, 0)], kinds)
        bad = ~right & (~none | needed[name])
        if bad.any():
            row = int(np.argmax(bad))
            words = " or ".join(KINDS[k] for k in kinds)
            also = "" if needed[name][row] else ", or -1 for none"
            raise InputError(
                f"{name} of row {row}, of kind {KINDS[kind[row]]}, is {link[row]}; it has to be the number of"
                f" an earlier row of kind {words}{also}; {MEND}"
            )

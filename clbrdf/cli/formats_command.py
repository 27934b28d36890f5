"""`clbrdf formats`: what is read and written."""

from __future__ import annotations

from clbrdf.cli.console import print_table
from clbrdf.formats.registry import formats


def command() -> None:
    """List the formats that 'clbrdf import' reads and 'clbrdf export' writes."""
    rows = [
        [each.name, each.title, " ".join(each.endings), "yes", each.holds or "yes" if each.write else "–"]
        for each in formats().values()
    ]
    print_table("formats", ("--format", "what it is", "ending", "read", "written"), rows, left=5)

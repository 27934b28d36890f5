"""`clbrdf demo`: the main job end to end."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.options import Overwrite
from clbrdf.cli.summary import print_fit
from clbrdf.demo import demo


def command(
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"], help="folder to write to")] = Path("demo"),
    overwrite: Overwrite = False,
) -> None:
    """Fit the synthetic yellow tin foil at 159 wavelengths; leave scan, fit and pictures in a folder."""
    with progress_bar("fitting the tin foil") as report:
        result, stages = demo(output, overwrite, report)
    print_fit("yellow tin foil, SYNTHETIC: Table 1 of the paper with 6.05 % noise", result)
    rows = [[s.name, s.file.name, f"{s.seconds:.1f}"] for s in stages]
    rows.append(["all", "", f"{sum(s.seconds for s in stages):.1f}"])
    print_table(f"in {output}", ("stage", "file", "seconds"), rows, left=2)

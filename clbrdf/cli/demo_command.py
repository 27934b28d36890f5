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
    """Measure yellow tin foil on an emulated rig, fit every wavelength; leave all of it in a folder."""
    with progress_bar("tin foil") as report:
        result, steps, missing = demo(output, overwrite, report)
    print_fit(f"{result.scan.sample}", result)
    rows = [[s.name, s.files, f"{s.seconds:.1f}"] for s in steps]
    rows.append(["all", "", f"{sum(s.seconds for s in steps):.1f}"])
    print_table(f"in {output}", ("stage", "files", "seconds"), rows, left=2)
    for line in missing:
        print(line)

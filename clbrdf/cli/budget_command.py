"""`clbrdf budget`: the error budget (3) to (7)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clbrdf.cli.console import number, print_table
from clbrdf.cli.options import JsonFile, Overwrite
from clbrdf.errors import InputError
from clbrdf.rig.budget import (
    GROUPS,
    KINDS,
    Budget,
    group_percent,
    kind_percent,
    load_budget,
    total_percent,
)
from clbrdf.rig.calibrate import calibrate
from clbrdf.rig.rawscan import read_raw
from clbrdf.scan import Scan
from clbrdf.scan.component import root_sum
from clbrdf.storage.files import check_output, whole_text

KIND_WORDS = {"scale": "scale", "incident angle": "by incident angle", "run": "by run", "point": "by point"}


def command(
    budget: Path | None = None,
    *,
    scan: Path | None = None,
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> None:
    """Print the error budget, equations (3) to (7); with a raw scan also the uncertainty of its points.

    "scale" shifts all points alike, "by incident angle" those of one incident angle, "by run" those that
    share a reading of the direct beam or the panel; "by point" differs from point to point.

    Parameters
    ----------
    budget
        budget file (TOML); the paper's values if not given
    scan
        scan file of 'clbrdf measure': sources are evaluated at each of its points
    """
    if json is not None:
        check_output(json, overwrite)
    chosen = load_budget(budget)
    measured = None if scan is None else _calibrated(scan, chosen)
    _print_budget(chosen, "the paper's values" if budget is None else str(budget))
    content: dict[str, object] = {
        "percent": {group: group_percent(chosen, group) for group in GROUPS},
        **{f"{kind.replace(' ', '_')}_percent": kind_percent(chosen, kind) for kind in KINDS},
        "total_percent": total_percent(chosen),
    }
    if scan is not None and measured is not None:
        content["points"] = _print_points(measured, scan)
    if json is not None:
        whole_text(json, content, overwrite)


def _calibrated(scan: Path, budget: Budget) -> Scan:
    try:
        return calibrate(read_raw(scan), budget)
    except InputError as error:
        raise error if str(scan) in str(error) else InputError(f"{scan}: {error}") from error


def _print_budget(budget: Budget, name: str) -> None:
    rows = []
    for group, equation in GROUPS.items():
        sources = budget.sources(group)
        if len(sources) > 1:
            rows += [[f"  {s.name}", "", KIND_WORDS[s.kind], f"{s.percent:.2f}"] for s in sources]
            rows.append([group, equation, "", f"{group_percent(budget, group):.2f}"])
        else:
            rows += [
                [f"{group}: {s.name}", equation, KIND_WORDS[s.kind], f"{s.percent:.2f}"] for s in sources
            ]
    parts = {kind: kind_percent(budget, kind) for kind in KINDS}
    rows += [
        [f"part {KIND_WORDS[kind]}", "", "", f"{part:.2f}"] for kind, part in parts.items() if part > 0.0
    ]
    rows.append(["total", "(3), (7)", "", f"{total_percent(budget):.2f}"])
    columns = ("source", "equation", "kind", "uncertainty (%)")
    print_table(f"error budget of the BRDF, {name}", columns, rows, left=3)


def _print_points(scan: Scan, path: Path) -> dict[str, object]:
    value = np.where(scan.mask, np.nan, scan.brdf)
    parts = {one.name: np.abs(one.absolute(scan.brdf)) for one in scan.components}
    kinds = {one.name: one.words() for one in scan.components}
    if scan.random_sigma is not None:
        parts["part by point"] = scan.random_sigma
    parts["common part"] = root_sum(scan.common_components, scan.brdf)
    assert scan.sigma is not None
    parts["total"] = scan.sigma
    rows: list[list[str]] = []
    content: dict[str, object] = {}
    for name, part in parts.items():
        absolute = np.where(scan.mask, np.nan, part)
        percent = 100.0 * np.abs(absolute / value)
        figures = (np.nanmedian(percent), np.nanmax(percent), np.nanmedian(absolute), np.nanmax(absolute))
        rows.append([name, kinds.get(name, ""), *(number(float(f), 3) for f in figures)])
        content[name] = dict(
            zip(("median_percent", "largest_percent", "median", "largest"), map(float, figures), strict=True)
        )
    columns = ("source", "errors in common", "median (%)", "largest (%)", "median (1/sr)", "largest (1/sr)")
    print_table(f"uncertainty of the {value.size} values of {path}", columns, rows, left=2)
    return content

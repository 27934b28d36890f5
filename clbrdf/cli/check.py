"""The check of a fit by other optimizers, as `clbrdf fit --check` runs and prints it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from clbrdf.cli.console import number, print_table, progress_bar, stdout_console
from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.optimizers.check import WAVELENGTHS, Verdict, check_fit, sample_places, tolerance_of
from clbrdf.parallel.executor import usable_cores
from clbrdf.parallel.processes import pool

NO_CHECK = 0
"""How many wavelengths are checked where no check is asked for."""

TITLES = {"least-squares": "E least squares", "evolution": "E evolution"}


def check_count(check: bool, wavelengths: str | None) -> int | None:
    """Return how many wavelengths the options ask for, None for all.

    Raises
    ------
    InputError
        Neither a whole number of 1 or more nor "all".
    """
    if wavelengths is None:
        return WAVELENGTHS if check else NO_CHECK
    if wavelengths == "all":
        return None
    if not (wavelengths.isascii() and wavelengths.isdigit() and int(wavelengths) >= 1):
        raise InputError(f"--check-wavelengths {wavelengths!r}: give a whole number of 1 or more, or all")
    return int(wavelengths)


def run_check(fit: Fit, count: int | None) -> tuple[Verdict, ...]:
    """Check so many wavelengths of a fit, with a progress bar; print and return the verdicts."""
    if count == NO_CHECK:
        return ()
    places = sample_places(fit, count)
    bar = progress_bar(f"checking {len(places)} wavelengths")
    with bar as report, pool(min(usable_cores(), len(places))) as executor:
        verdicts = check_fit(fit, places, executor=executor, report=report)
    print_check(verdicts, len(fit.wavelength), tolerance_of(fit))
    return verdicts


def print_check(verdicts: Sequence[Verdict], wavelengths: int, tolerance: float) -> None:
    """Print a verdict per wavelength, and the sum of them in words."""
    names = list(verdicts[0].found)
    rows = [
        [
            number(v.wavelength, 6),
            number(v.objective, 10),
            *(number(v.found[name], 10) for name in names),
            "0" if v.gap == 0.0 else f"{v.gap:+.1e}",
            v.word,
        ]
        for v in verdicts
    ]
    title = f"Check: {len(verdicts)} of {wavelengths} wavelengths searched again"
    columns = ("λ (nm)", "E", *(TITLES[name] for name in names), "gap", "verdict")
    print_table(title, columns, rows, left=0)
    stdout_console().print(check_words(verdicts, tolerance))


def check_words(verdicts: Sequence[Verdict], tolerance: float) -> str:
    """Return what the verdicts come to."""
    counts = Counter(v.word for v in verdicts)
    told = ", ".join(f"{count} {word}" for word, count in counts.most_common())
    worse = [v for v in verdicts if v.word == "worse"]
    if not worse:
        return f"{told}; a gap of E up to {tolerance:g} relative is agreement"
    worst = max(worse, key=lambda v: v.gap)
    at = ", ".join(f"{v.wavelength:g}" for v in worse[:8]) + (", …" if len(worse) > 8 else "")
    return (
        f"{told}: the fit is not at the global optimum at {at} nm;"
        f" the worst E is {worst.gap:.2g} relative above the best found"
    )


def verdict_content(verdicts: Sequence[Verdict], tolerance: float) -> dict[str, Any]:
    """Return verdicts as plain values for JSON."""
    return {"tolerance": tolerance, "verdicts": [asdict(v) for v in verdicts]}

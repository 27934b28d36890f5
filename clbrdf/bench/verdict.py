"""What a comparison of optimizers comes to, in words that its numbers choose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clbrdf.bench.comparison import TARGETS
from clbrdf.bench.profiles import Costs, expected_running_time, success_rates
from clbrdf.fit import METHODS
from clbrdf.optimizers import OPTIMIZERS

QUALITY = 1e-6
"""Gap at which contenders are ranked: what a fit has to reach."""

ROUGH = 1e-3
RELIABLE = 0.995
"""Share of runs from which a contender counts as sure: one miss in 200 is allowed."""

SURE = f"{100.0 * RELIABLE:g} % of runs or more"


def verdict(table: Sequence[Costs], budget: int) -> str:
    """Return one paragraph: who reaches the optimum, at what cost, who does not, and which to use when."""
    at, rough = TARGETS.index(QUALITY), TARGETS.index(ROUGH)
    rates = {c.contender: success_rates(c) for c in table}
    costs = {
        axis: {c.contender: float(expected_running_time(c, axis)[at]) for c in table}
        for axis in ("evaluations", "seconds")
    }
    peers = [c.contender for c in table if c.contender in OPTIMIZERS]
    ours = [c.contender for c in table if c.contender in METHODS]
    seconds = costs["seconds"]
    wavelengths = max((len(c.problems) for c in table), default=0)
    runs = max((c.spent.size for c in table), default=0)

    def told(name: str) -> str:
        share = f"{_percent(rates[name][at])} of runs"
        if not np.isfinite(seconds[name]):
            return f"{title(name)} (never)"
        per_success = f"{costs['evaluations'][name]:.0f} evaluations or {_time(seconds[name])} a success"
        return f"{title(name)} ({share}, {per_success})"

    sure = sorted((n for n in peers + ours if rates[n][at] >= RELIABLE), key=lambda n: seconds[n])
    out = [
        f"Over {wavelengths} wavelengths, up to {runs} runs a contender and"
        f" {budget} evaluations a run, "
        + (
            f"a gap of {QUALITY:g} was reached in {SURE} by {_list([told(n) for n in sure])}."
            if sure
            else f"nobody reached a gap of {QUALITY:g} in {SURE}."
        )
    ]
    for derivatives, words in ((True, "With derivatives"), (False, "Without derivatives")):
        group = [n for n in peers if OPTIMIZERS[n].gradient == derivatives]
        if group:
            best = max(group, key=lambda n: (rates[n][at], rates[n][rough], -seconds[n]))
            least = rates[best][at] < 0.5
            out.append(
                f"{words} none reached it in half of its runs; the best is {told(best)}."
                if least
                else f"{words} the best of the optimizers is {title(best) if best in sure else told(best)}."
            )
    poor = [n for n in peers if rates[n][rough] < 0.5]
    if poor:
        out.append(f"Less than half of their runs came within {ROUGH:g}: {_list([title(n) for n in poor])}.")
    out.append(_advice(peers, ours, rates, seconds, at))
    return " ".join(out)


def _advice(
    peers: Sequence[str],
    ours: Sequence[str],
    rates: dict[str, np.ndarray],
    seconds: dict[str, float],
    at: int,
) -> str:
    """Which to use when: the surest, and of those as sure the fastest."""

    def rank(name: str) -> tuple[float, float]:
        return (min(float(rates[name][at]), RELIABLE), -seconds[name])

    words = []
    if ours:
        best = max(ours, key=rank)
        words.append(
            f"For scans of many wavelengths use {title(best)}"
            f" ({_time(seconds[best])} a wavelength on the whole device,"
            f" {_percent(rates[best][at])} within {QUALITY:g})"
        )
        if rates[best][at] < RELIABLE:
            words[-1] += " and look at it with --check"
    if peers:
        best = max(peers, key=rank)
        if rates[best][at] > 0.0:
            words.append(
                f"for one wavelength, or to check a fit, {title(best)} ({_time(seconds[best])} on one core)"
            )
    text = "; ".join(words) or "nothing was compared"
    return text[0].upper() + text[1:] + "."


def title(name: str) -> str:
    """Return how a contender is printed."""
    return OPTIMIZERS[name].title if name in OPTIMIZERS else f"clbrdf {name}"


def _percent(share: float) -> str:
    """Return a share; less than all is never told as 100 %."""
    return "100 %" if share == 1.0 else f"{min(99.9, 100.0 * share):.3g} %"


def _time(seconds: float) -> str:
    if seconds >= 1.0:
        return f"{seconds:.3g} s"
    return f"{1e3 * seconds:.0f} ms" if seconds >= 0.01 else f"{1e3 * seconds:.2g} ms"


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"

"""`clbrdf bench fit`: tables and words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from clbrdf.bench.fit_race import (
    DIRECTIONS,
    FOUND,
    PEER_WAVELENGTHS,
    PeerRun,
    RacePlan,
    RaceRun,
    found_share,
    growth,
    peer_places,
    run_race,
    seconds_by_size,
)
from clbrdf.cli.console import print_table, progress_bar, stdout_console
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.opencl.device import Device


def bench_fit(device: Device, full: bool = False, model: str = DEFAULT_MODEL) -> dict[str, Any]:
    """Time fits and peers; print tables and the ratio, return all numbers.

    With `full`, chains too run at every size: some twenty minutes on two cores.
    """
    get_model(model)
    chosen = RacePlan()
    if model != DEFAULT_MODEL:
        chosen = replace(chosen, model=model)
    if full:
        chosen = replace(chosen, slow_sizes=chosen.sizes)
    with progress_bar("fits and peers") as report:
        runs, peers = run_race(chosen, device, report)
    print(f"{chosen.model}; {device}, {device.compute_units} units\n")
    largest = max(chosen.sizes)
    for incident in chosen.incident:
        ours = [run for run in runs if run.incident == incident]
        others = [peer for peer in peers if peer.incident == incident]
        lowest = lowest_known(ours, others, largest)
        _print_ours(incident, ours, lowest, largest)
        _print_peers(incident, ours, others, lowest[peer_places(largest)], largest)
    return {
        "model": chosen.model,
        "runs": [{**asdict(run), "objective": run.objective.tolist()} for run in runs],
        "peers": [
            {**asdict(p), "seconds": p.seconds.tolist(), "objective": p.objective.tolist()} for p in peers
        ],
    }


def lowest_known(runs: Sequence[RaceRun], peers: Sequence[PeerRun], largest: int) -> np.ndarray:
    """Return the lowest E (W,) that anybody reached at the wavelengths of the largest fit."""
    same = [run for run in runs if run.wavelengths == largest and run.directions == DIRECTIONS]
    lowest = np.min([run.objective for run in same], axis=0)
    places = peer_places(largest)
    for peer in peers:
        lowest[places] = np.minimum(lowest[places], peer.objective)
    return np.asarray(lowest)


def _print_ours(incident: int, runs: Sequence[RaceRun], lowest: np.ndarray, largest: int) -> None:
    rows = []
    groups = {(run.method, run.wavelengths, run.directions): None for run in runs}
    for method, w, n in groups:
        same = [r for r in runs if (r.method, r.wavelengths, r.directions) == (method, w, n)]
        seconds = float(np.median([run.seconds for run in same]))
        whole = w == largest and n == DIRECTIONS
        found = f"{100 * found_share(same[0].objective, lowest):.0f} %" if whole else ""
        peak = max(run.peak for run in same) / 1e9
        rows.append(
            [method, str(w), str(n), f"{seconds:.3g}", f"{1e3 * seconds / w:.3g}", f"{peak:.2f}", found]
        )
    heads = ("", "W", "N", "seconds", "ms a wavelength", "peak GB", "found")
    print_table(f"{incident} incident angles: fits of W wavelengths × N directions", heads, rows)


def _print_peers(
    incident: int, runs: Sequence[RaceRun], peers: Sequence[PeerRun], lowest: np.ndarray, largest: int
) -> None:
    auto = seconds_by_size(runs, incident)[largest] / largest
    rows = []
    for peer in peers:
        each = float(np.mean(peer.seconds))
        share = found_share(peer.objective, lowest)
        budget = str(peer.evaluations) if peer.evaluations else "its own"
        rows.append([peer.name, budget, f"{1e3 * each:.3g}", f"{100 * share:.0f} %", f"{each / auto:.0f}"])
    heads = ("", "evaluations", "ms a wavelength", "found", "× auto")
    title = f"{incident} incident angles: peers on one core, on {len(lowest)} of {largest} wavelengths"
    print_table(title, heads, rows)
    able = [p for p in peers if found_share(p.objective, lowest) == 1.0]
    if able:
        best = min(able, key=lambda p: float(np.mean(p.seconds)))
        text = (
            f"Of the peers that found every optimum (within {FOUND:g}), {best.name} with {best.evaluations}"
            f" evaluations was the fastest; auto took {np.mean(best.seconds) / auto:.0f} times less."
        )
    else:
        text = f"No peer found all {PEER_WAVELENGTHS} optima within {FOUND:g}."
    doubled = growth(runs, incident, largest)
    stdout_console().print(f"{text} Twice the wavelengths take {doubled:.2f} times as long.\n")

"""`clbrdf bench throughput --model` and `clbrdf bench fit --model`: one row a model."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from clbrdf.bench.fit_race import FOUND
from clbrdf.bench.model_race import PEER, race_model
from clbrdf.bench.throughput import Contender, model_contenders, race
from clbrdf.cli.console import print_table, progress_bar, stdout_console
from clbrdf.models import get_model, model_names
from clbrdf.opencl.device import Device
from clbrdf.parallel.ending import scratch_folder

SUMS = (
    "ggx+lambert",
    "ggx+minnaert",
    "ggx+ggx+lambert",
    "abg+abg+lambert",
    "wang2013+eon",
    "beckmann+lambert",
)
"""Raced beside the single models where all are asked for."""

WAVELENGTHS = 2048


def listed_models(text: str) -> tuple[str, ...]:
    """Return the models of a list, all single ones and some sums for "all".

    Raises
    ------
    InputError
        No model has one of the names.
    """
    names = (*model_names(), *SUMS) if text == "all" else tuple(name.strip() for name in text.split(","))
    return tuple(get_model(name).name for name in names)


def bench_models_throughput(names: tuple[str, ...], device: Device) -> dict[str, Any]:
    """Time E of each model beside the same formula in C, interleaved; print a table, return the numbers."""
    rows, kept = [], []
    with scratch_folder() as folder, progress_bar("models") as report:
        for done, name in enumerate(names):
            timed = race(model_contenders(name, device, folder))
            rows.append([name, *_throughput_words(timed, "fp32"), *_throughput_words(timed, "fp64")])
            kept += [{"name": c.name, "group": c.group, "rate": c.rate, "ratio": None} for c in timed]
            report(done + 1, len(names))
    print(f"{device}, {device.compute_units} units\n")
    heads = ("", "fp32", "C", "× C", "fp64", "C", "× C")
    print_table("E of a model, million evaluations a second, median of interleaved rounds", heads, rows)
    return {"throughput": kept}


def _throughput_words(timed: list[Contender], group: str) -> list[str]:
    both = [c for c in timed if c.group == group]
    if not both:
        return ["–", "–", "–"]
    ours = both[0]
    if len(both) < 2:
        return [f"{ours.rate:.0f}", "–", "–"]
    ratio = float(np.median(np.array(both[1].seconds) / np.array(ours.seconds)))
    return [f"{ours.rate:.0f}", f"{both[1].rate:.0f}", f"{ratio:.2f}"]


def bench_models_fit(names: tuple[str, ...], device: Device) -> dict[str, Any]:
    """Time whole fits of each model beside least squares from random starts; print a table."""
    races = []
    with progress_bar("fits and peers") as report:
        for done, name in enumerate(names):
            races.append(race_model(name, WAVELENGTHS, device))
            report(done + 1, len(names))
    print(f"{device}, {device.compute_units} units\n")
    rows = [
        [
            r.model,
            f"{r.milliseconds:.3g}",
            f"{100 * r.found:.0f} %",
            f"{r.peak / 1e9:.2f}",
            str(r.budget),
            f"{1e3 * r.peer_seconds:.3g}",
            f"{100 * r.peer_found:.0f} %",
            f"{r.ratio:.0f}",
        ]
        for r in races
    ]
    title = f"Fits of {WAVELENGTHS} wavelengths × {races[0].directions} directions beside {PEER} on one core"
    heads = ("", "ours ms", "found", "peak GB", "evaluations", "peer ms", "found", "× ours")
    print_table(title, heads, rows)
    stdout_console().print(f"Milliseconds a wavelength; found: within {FOUND:g} of the lowest E known.\n")
    return {"fits": [asdict(r) for r in races]}

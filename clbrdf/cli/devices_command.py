"""`clbrdf devices`: what could run the kernels, and what will."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from cyclopts import Parameter

from clbrdf.bench.tune import Trial, tune
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.options import DeviceName
from clbrdf.cli.rig_devices import print_rig_devices
from clbrdf.opencl.device import Device, choose_device, list_devices
from clbrdf.opencl.lanes import lanes_of, read_answers


def command(
    *,
    device: DeviceName = None,
    tune_lanes: Annotated[bool, Parameter(name="--tune", negative="")] = False,
    rig: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """List the OpenCL devices, the one that would be used marked with *.

    Parameters
    ----------
    tune_lanes
        find the fastest lanes of that device by building and timing them, each in a process of its own,
        and keep the answer
    rig
        list the drivers of the rig and the instruments that are connected instead
    """
    if rig:
        print_rig_devices()
        return
    chosen = choose_device(device)
    if tune_lanes:
        with progress_bar(f"tuning {chosen.name}") as report:
            trials, path = tune(chosen, report)
        _print_trials(chosen, trials)
        print(f"kept in {path}\n")
    rows = [
        [
            "*" if d == chosen else "",
            d.name,
            d.kind,
            " ".join(f"{d.platform}, {d.version}".split()[:8]),
            f"{d.compute_units}",
            f"{d.memory / 2**30:.1f}",
            str(lanes_of(d, np.float32)),
            str(lanes_of(d, np.float64)) if d.has_double else "–",
            "yes" if read_answers(d) else "no",
        ]
        for d in list_devices()
    ]
    columns = ("", "device", "kind", "platform", "units", "GiB", "fp32", "fp64", "tuned")
    print_table("OpenCL devices; fp32, fp64: lanes × unrolling", columns, rows, left=4)


def _print_trials(device: Device, trials: list[Trial]) -> None:
    rows = [
        [
            "fp32" if t.dtype == "float32" else "fp64",
            str(t.lanes),
            f"{t.rate:.0f}" if t.rate else "–",
            t.failure or ("*" if t.lanes == lanes_of(device, np.dtype(t.dtype).type) else ""),
        ]
        for t in trials
    ]
    print_table("Million model evaluations a second", ("type", "lanes", "M/s", ""), rows, left=2)

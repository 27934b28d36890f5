"""Model values on grids of directions × wavelengths: the kernel alone, `evaluate`, scenes, scenes to a file.

Two grids: in memory 1.4 million values, where a scene without effects is compared with `evaluate`; to a file
the hemisphere at 1° × 1° × 381 wavelengths, 12 million values, where a stream is compared with the kernel.
Interleaved, with medians; what syncs the file to the disk at the end is the disk's time, and told apart.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clbrdf.evaluate import evaluate
from clbrdf.models import get_model
from clbrdf.opencl.device import Device, open_queue
from clbrdf.opencl.precision import PRECISIONS, get_precision
from clbrdf.opencl.program import Variant, build
from clbrdf.opencl.values import feature_rows, features_in_parts, upload_features, upload_parameters
from clbrdf.parallel.ending import scratch_folder
from clbrdf.progress import Report, silent
from clbrdf.scene.scenefile import Scene
from clbrdf.scene.simulate import Setting, set_up, values_of
from clbrdf.scene.stream import stream

ROUNDS = 15

IN_MEMORY: dict[str, Any] = {
    "directions": {
        "theta_i": [30, 45, 60],
        "theta_r": {"start": 0, "stop": 85, "step": 1},
        "phi_r": {"start": 0, "stop": 350, "step": 10},
        "region": "hemispherical",
    },
    "wavelength": {"start": 400, "stop": 700, "step": 2},
}

TO_A_FILE: dict[str, Any] = {
    "directions": {
        "theta_i": 45,
        "theta_r": {"start": 0, "stop": 89, "step": 1},
        "phi_r": {"start": 0, "stop": 359, "step": 1},
        "region": "hemispherical",
    },
    "wavelength": {"start": 380, "stop": 760, "step": 1},
}

SLOPE, CENTRE = 20.0, 550.0
"""Of c over wavelength: per 100 nm about this one, nm."""


@dataclass(frozen=True)
class GridRun:
    """One way to compute a grid of values.

    Attributes
    ----------
    grid, name : str
    values : int
    seconds : tuple of float
        One a round.
    syncing : tuple of float
        Seconds more until a file is safe on the disk, one a round; empty without a file.
    """

    grid: str
    name: str
    values: int
    seconds: tuple[float, ...]
    syncing: tuple[float, ...] = ()

    @property
    def median(self) -> float:
        """Median seconds."""
        return float(np.median(self.seconds))


def grid_scene(grid: dict[str, Any], precision: str) -> Scene:
    """Return a scene of tin foil without effects, its c a straight line over wavelength."""
    curve = {"polynomial": [-300.0, SLOPE], "centre": CENTRE, "scale": 100.0}
    return Scene.model_validate({**grid, "surface": {"parameters": {"c": curve}}, "precision": precision})


def kernel_alone(setting: Setting, precision: str, device: Device) -> Callable[[], None]:
    """Return the evaluate kernel for all values of a scene in one launch, everything on the device."""
    import pyopencl as cl

    chosen, model = get_precision(precision), get_model()
    variant = Variant.on(device, "evaluate", model, chosen, ("pair",) if chosen.careful else ())
    x = features_in_parts(model, setting.true, chosen)
    rows = feature_rows(x[:, None, :], variant.lanes.width)
    features = upload_features(rows, chosen, device)
    parameters = model.vector({"c": curve_of(setting)})
    sets = upload_parameters(model, parameters, chosen, device)
    queue, padded, w = open_queue(device), rows.shape[-1], len(parameters)
    size = np.dtype(chosen.dtype).itemsize * padded * w
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, size)
    kernel = cl.Kernel(build(device, variant), "evaluate")
    shape = (padded // variant.lanes.width, w)

    def run() -> None:
        kernel(queue, shape, None, features, np.uint64(padded), sets, result)
        queue.finish()

    return run


def curve_of(setting: Setting) -> np.ndarray:
    """Return c (W,) of a grid scene."""
    return np.asarray(-300.0 + SLOPE * (setting.wavelength - CENTRE) / 100.0)


def measure_grids(device: Device, report: Report = silent) -> list[GridRun]:
    """Measure both grids in every precision that the device has."""
    able = [name for name, p in PRECISIONS.items() if p.dtype is np.float32 or device.has_double]
    with scratch_folder() as folder:
        whole = _hemisphere(device, able, folder, _part(report, 0, 2))
    return [*_memory(device, [n for n in ("single", "double") if n in able], _part(report, 1, 2)), *whole]


def _memory(device: Device, precisions: list[str], report: Report) -> list[GridRun]:
    """`evaluate` and a scene without effects, in turn and in changing order."""
    runs: dict[str, Callable[[], object]] = {}
    count = 0
    for name in precisions:
        setting = set_up(grid_scene(IN_MEMORY, name), device=device)
        count = len(setting.nominal) * len(setting.wavelength)
        runs[f"evaluate, {name}"] = _evaluated(setting, name, device)
        runs[f"scene without effects, {name}"] = partial(values_of, setting)
    times: dict[str, list[float]] = {name: [] for name in runs}
    for k in range(2 * ROUNDS + 1):
        for name in sorted(runs, reverse=bool(k % 2)):
            start = time.perf_counter()
            runs[name]()
            if k:  # the first one builds
                times[name].append(time.perf_counter() - start)
        report(k + 1, 2 * ROUNDS + 1)
    return [GridRun("in memory", name, count, tuple(values)) for name, values in times.items()]


def _evaluated(setting: Setting, precision: str, device: Device) -> Callable[[], object]:
    d, c = setting.nominal, curve_of(setting)
    return lambda: evaluate({"c": c}, d.theta_i, d.theta_r, d.phi, precision=precision, device=device)


def _hemisphere(device: Device, precisions: list[str], folder: Path, report: Report) -> list[GridRun]:
    """Run the kernel alone in every precision, and streams into files in two of them."""
    settings = {name: set_up(grid_scene(TO_A_FILE, name), device=device) for name in precisions}
    kernels = {name: kernel_alone(settings[name], name, device) for name in precisions}
    streamed = [name for name in ("single", "double") if name in precisions]
    times: dict[str, list[float]] = {}
    syncing: dict[str, list[float]] = {}
    count = 0
    for k in range(ROUNDS + 1):
        for name in precisions:
            kernels[name]()  # wakes the cores
            start = time.perf_counter()
            kernels[name]()
            if k:
                times.setdefault(f"kernel alone, {name}", []).append(time.perf_counter() - start)
        for name in streamed:
            done = stream(settings[name], folder / "grid.h5", overwrite=True)
            count = done.values
            if k:
                times.setdefault(f"scene to a file, {name}", []).append(done.seconds)
                syncing.setdefault(f"scene to a file, {name}", []).append(done.syncing)
        report(k + 1, ROUNDS + 1)
    return [
        GridRun("hemisphere", name, count, tuple(values), tuple(syncing.get(name, ())))
        for name, values in times.items()
    ]


def _part(report: Report, place: int, parts: int) -> Report:
    return lambda done, total: report(place * total + done, parts * total)

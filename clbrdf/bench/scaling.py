"""Time and memory of whole fits over the number of directions and of wavelengths.

Each runs in a process of its own. Values have 2 % noise. The optimum is held against a search on all
directions, where there are so few of them that it fits into memory.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.fit_race import drifting, foil_like
from clbrdf.bench.memory import peak_memory
from clbrdf.errors import DeviceError
from clbrdf.geometry import Directions
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

NOISE = 0.02
BLOCK = 1 << 15
"""Directions whose values are made at once."""

INCIDENT = 6
"""Incident angles of the usual scans."""

FEW, USUAL = 16, 774
"""Wavelengths of the scans with more and more directions; directions of those with more wavelengths."""

DIRECTIONS = (100, 316, 1000, 3162, 10_000, 31_623, 100_000, 316_228, 1_000_000)
WAVELENGTHS = (16, 64, 256, 1024, 4096, 16_384)

MERL = (1_458_000, 3, "ggx+lambert")
"""Directions, bands and model of a MERL file: no two directions share an incident one."""

MOST_FULL = 100_000
"""Directions up to which the search is done on all of them, too."""


@dataclass(frozen=True)
class ScalingPoint:
    """One whole fit.

    Attributes
    ----------
    model : str
    directions, wavelengths : int
    seconds, cpu : float
        Wall time, and the time of all cores together; kernels were built before.
    peak : float
        Largest resident memory of the process, bytes, scan included.
    excess : float
        Largest relative excess of E over a search on all directions; NaN where there was none.
    """

    model: str
    directions: int
    wavelengths: int
    seconds: float
    cpu: float
    peak: float
    excess: float

    @property
    def each(self) -> float:
        """Wall nanoseconds a wavelength and direction."""
        return 1e9 * self.seconds / (self.directions * self.wavelengths)


def scaling_scan(directions: int, wavelengths: int, model: str) -> Scan:
    """Return a noisy scan in random directions; one of few bands has an incident direction for each."""
    chosen, rng = get_model(model), np.random.default_rng(2013)
    if wavelengths > MERL[1]:
        theta_i = rng.choice(np.linspace(10.0, 60.0, INCIDENT), directions)
    else:
        theta_i = rng.uniform(0.0, 75.0, directions)
    d = Directions.relative(theta_i, rng.uniform(0.0, 80.0, directions), rng.uniform(0.0, 360.0, directions))
    nm = np.linspace(400.0, 800.0, wavelengths)
    sets = foil_like(nm) if model == DEFAULT_MODEL else drifting(chosen, nm)
    brdf = np.empty((directions, wavelengths))
    for first in range(0, directions, BLOCK):
        part = slice(first, first + BLOCK)
        for some in np.array_split(np.arange(wavelengths), -(-wavelengths // 256)):
            f = chosen.brdf(sets[some, None, :], chosen.features(d[part])).T
            brdf[part, some] = f * np.abs(1.0 + NOISE * rng.standard_normal(f.shape))
    brdf.flags.writeable = False  # the scan takes it as it is
    return Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, nm, brdf)


def measure_sizes(device: Device, report: Report = silent) -> list[ScalingPoint]:
    """Return the points over directions, over wavelengths, and of a file of MERL's size.

    Raises
    ------
    DeviceError
        A fit failed.
    """
    sizes = [(n, FEW, DEFAULT_MODEL) for n in DIRECTIONS] + [(USUAL, w, DEFAULT_MODEL) for w in WAVELENGTHS]
    points = []
    for k, size in enumerate([*sizes, MERL]):
        points.append(fit_in_child(*size, device))
        report(k + 1, len(sizes) + 1)
    return points


def fit_in_child(directions: int, wavelengths: int, model: str, device: Device) -> ScalingPoint:
    """Fit a scan in a fresh process, and where it is small enough search on all directions in another.

    Raises
    ------
    DeviceError
        A process failed.
    """
    task = {"directions": directions, "wavelengths": wavelengths, "model": model, "device": device.name}
    row = _run({**task, "everywhere": False})
    excess = float("nan")
    if directions <= MOST_FULL:
        whole = np.array(_run({**task, "everywhere": True})["objective"])
        excess = float((np.array(row["objective"]) / whole - 1.0).max())
    return ScalingPoint(model, directions, wavelengths, row["seconds"], row["cpu"], row["peak"], excess)


def _run(task: dict[str, Any]) -> dict[str, Any]:
    code = "from clbrdf.bench.scaling import child; child()"
    command = [sys.executable, "-P", "-c", code, json.dumps(task)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        last = ended.stderr.strip().splitlines()[-1:] or ["no message"]
        size = f"{task['directions']} directions at {task['wavelengths']} wavelengths"
        raise DeviceError(f"the fit of {size} failed: {last[0]}")
    found: dict[str, Any] = json.loads(ended.stdout)
    return found


def child() -> None:
    """Fit the scan that the command line tells; print seconds, peak memory and E as JSON."""
    from clbrdf.fit import DictionarySettings, LookupSettings, fit
    from clbrdf.opencl.device import choose_device

    task: dict[str, Any] = json.loads(sys.argv[1])
    device, model = choose_device(task["device"]), task["model"]
    scan = scaling_scan(task["directions"], task["wavelengths"], model)
    kind = DictionarySettings if get_model(model).structure is not None else LookupSettings
    settings = kind(everywhere=task["everywhere"])
    few = scan.rows(np.arange(min(len(scan), 5000))).columns(np.arange(min(2, len(scan.wavelength))))
    fit(few, model=model, settings=settings, device=device)
    start, cpu = time.perf_counter(), time.process_time()
    result = fit(scan, model=model, settings=settings, device=device)
    row = {"seconds": time.perf_counter() - start, "cpu": time.process_time() - cpu, "peak": peak_memory()}
    print(json.dumps({**row, "objective": result.objective.tolist()}))


def as_rows(points: list[ScalingPoint]) -> list[dict[str, Any]]:
    """Return points as plain values."""
    return [{**asdict(point), "nanoseconds": point.each} for point in points]

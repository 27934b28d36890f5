"""Time to fit W wavelengths: our methods, whole fits in processes of their own, beside peers per wavelength.

Peers minimise E in NumPy, fp64, with analytic derivatives, one wavelength after the other on one core, and
are timed on a few wavelengths, which scales; each gets the smallest of growing budgets with which it finds
the optimum at all of them. Found is within 1e-6 of the lowest E that anybody reached. The peers' runs lie
between ours, so that a machine that slows down slows both.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.memory import peak_memory
from clbrdf.device import Device
from clbrdf.errors import DeviceError
from clbrdf.fit.problem import make_problem
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from clbrdf.optimizers import minimise
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

NOISE = 0.02
FOUND = 1e-6
PEER_WAVELENGTHS = 16

VIEWS = {3: (86, 1.0), 6: (43, 2.0)}
"""View zeniths and their spacing by the number of incident angles; with three azimuths, 774 directions."""

DIRECTIONS = 774

AZIMUTHS = (180.0, 90.0, 45.0)

BUDGETS = {
    "least-squares": (250, 500, 1000, 2000, 4000),
    "mlsl-lbfgs": (1000, 4000),
    "evolution": (4000, 16000),
}
"""Evaluations of E, a value with its derivatives as two, by optimizer."""

DEFAULT_ANNEALING = "scipy dual_annealing, as called by default"


def race_scan(incident: int, wavelengths: int, views: float = 1.0) -> Scan:
    """Return a noisy synthetic scan whose parameters change slowly with wavelength.

    Parameters
    ----------
    incident : int
        3 or 6 incident angles.
    wavelengths : int
        W, from 400 to 800 nm.
    views : float
        Factor on the number of view zeniths.
    """
    model, rng = get_model(), np.random.default_rng(2013)
    d = race_directions(incident, views)
    nm = np.linspace(400.0, 800.0, wavelengths)
    empty = Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, nm, np.ones((len(d), wavelengths)))
    turn = 2.0 * np.pi * (nm - 400.0) / 400.0
    sets = model.vector(
        {
            "a": 3.87 + 0.3 * np.sin(turn),
            "b": 0.5216 + 0.02 * np.cos(turn),
            "c": -300.0 * (1.0 + 0.3 * np.sin(2.0 * turn)),
            "d": 0.74 + 0.02 * np.sin(turn),
            "ks": 300.0 + 150.0 * np.sin(0.5 * turn),
            "kd": 1.3 + 0.4 * np.cos(turn),
        }
    )
    exact = model.brdf(sets[:, None, :], model.features(empty.directions)).T
    return replace(empty, brdf=np.abs(exact * (1.0 + NOISE * rng.standard_normal(exact.shape))))


def race_directions(incident: int, views: float = 1.0) -> Directions:
    """Return the directions of a race: 3 or 6 incident angles, three azimuths, views times a factor."""
    count, spacing = VIEWS[incident]
    theta_i = np.linspace(30.0, 60.0, 3) if incident == 3 else np.linspace(10.0, 60.0, 6)
    theta_r = np.linspace(0.0, (count - 1) * spacing, round(count * views))
    i, phi, r = (grid.ravel() for grid in np.meshgrid(theta_i, AZIMUTHS, theta_r, indexing="ij"))
    return Directions.relative(i, r, phi)


@dataclass(frozen=True, eq=False)
class Run:
    """One whole fit by one of our methods, in a process of its own.

    Attributes
    ----------
    method : str
    incident, directions, wavelengths : int
    seconds : float
        Wall time of the fit; kernels were built before.
    peak : float
        Largest resident memory of the process, bytes.
    objective : (W,) float64
        E.
    """

    method: str
    incident: int
    directions: int
    wavelengths: int
    seconds: float
    peak: float
    objective: Array


@dataclass(frozen=True, eq=False)
class PeerRun:
    """One peer with one budget on a few wavelengths.

    Attributes
    ----------
    name : str
    incident, evaluations : int
        Budget of a wavelength; 0 where the peer sets its own.
    seconds : (K,) float64
        A wavelength each.
    objective : (K,) float64
    """

    name: str
    incident: int
    evaluations: int
    seconds: Array
    objective: Array


def fit_in_child(method: str, incident: int, wavelengths: int, device: Device, views: float = 1.0) -> Run:
    """Fit a race scan in a fresh process and tell time and memory.

    Raises
    ------
    DeviceError
        The process failed.
    """
    task = {
        "method": method,
        "incident": incident,
        "wavelengths": wavelengths,
        "views": views,
        "device": device.name,
    }
    command = [
        sys.executable,
        "-P",
        "-c",
        "from clbrdf.bench.fit_race import child; child()",
        json.dumps(task),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        last = ended.stderr.strip().splitlines()[-1:] or ["no message"]
        raise DeviceError(f"the fit of {wavelengths} wavelengths by {method} failed: {last[0]}")
    row = json.loads(ended.stdout)
    directions = row["directions"]
    return Run(
        method, incident, directions, wavelengths, row["seconds"], row["peak"], np.array(row["objective"])
    )


def child() -> None:
    """Fit the scan that the command line tells; print seconds, peak memory and E as JSON."""
    from clbrdf.device import choose_device
    from clbrdf.fit import fit

    task: dict[str, Any] = json.loads(sys.argv[1])
    device, method = choose_device(task["device"]), task["method"]
    scan = race_scan(task["incident"], task["wavelengths"], task["views"])
    fit(scan.columns(np.arange(min(4, task["wavelengths"]))), method=method, device=device)
    start = time.perf_counter()
    result = fit(scan, method=method, device=device)
    seconds = time.perf_counter() - start
    row = {"seconds": seconds, "peak": peak_memory(), "objective": result.objective.tolist()}
    print(json.dumps({**row, "directions": len(scan.theta_i)}))


def race_peer(name: str, incident: int, wavelengths: int, budget: int, device: Device) -> PeerRun:
    """Let one peer fit some of the wavelengths of a race scan, evenly chosen, with one budget."""
    model = get_model()
    scan = race_scan(incident, wavelengths)
    places = peer_places(wavelengths)
    problem = make_problem(
        scan.columns(places), weight_matrix(scan)[:, places], model, model.bounds(), device
    )
    seconds, energy = [], []
    for k in range(len(places)):
        objective = NumpyObjective(problem, k)
        start = time.perf_counter()
        if name == DEFAULT_ANNEALING:
            energy.append(_default_annealing(objective, k))
        else:
            trace = minimise(name, objective, evaluations=budget, seed=k)
            energy.append(float(trace.objective[-1]))
        seconds.append(time.perf_counter() - start)
    return PeerRun(name, incident, budget, np.array(seconds), np.array(energy))


def peer_places(wavelengths: int) -> npt.NDArray[np.intp]:
    """Places of the wavelengths that peers fit."""
    count = min(PEER_WAVELENGTHS, wavelengths)
    return np.linspace(0, wavelengths - 1, count).round().astype(np.intp)


def _default_annealing(objective: NumpyObjective, seed: int) -> float:
    """E where SciPy's dual_annealing ends with nothing but its defaults."""
    from scipy.optimize import dual_annealing

    box = list(zip(objective.lower, objective.upper, strict=True))

    def energy(q: Array) -> float:
        return float(objective.values(q[None, :])[0])

    end = dual_annealing(energy, box, seed=seed)
    return float(end.fun)


@dataclass(frozen=True)
class Plan:
    """What a race measures.

    Attributes
    ----------
    sizes : tuple of int
        W for the fastest method; all but the largest are run for the growth.
    slow_sizes : tuple of int
        W for the methods that search by chains.
    incident : tuple of int
    peers : mapping of str to tuple of int
        Budgets, in growing order; (0,) for the default annealing.
    """

    sizes: tuple[int, ...] = (16, 64, 256, 1024, 2048)
    slow_sizes: tuple[int, ...] = (16, 64)
    incident: tuple[int, ...] = (3, 6)
    peers: tuple[tuple[str, tuple[int, ...]], ...] = (*BUDGETS.items(), (DEFAULT_ANNEALING, (0,)))


VIEW_FACTORS = (0.5, 2.0)
"""On the number of directions, for the growth with N; at a middle number of wavelengths."""

SLOW = ("tempering", "anneal-separable", "anneal")


def run_race(plan: Plan, device: Device, report: Report = silent) -> tuple[list[Run], list[PeerRun]]:
    """Run everything of a plan; the fits of the largest size before, between and after the peers."""
    runs: list[Run] = []
    peers: list[PeerRun] = []
    largest, middle = max(plan.sizes), sorted(plan.sizes)[len(plan.sizes) // 2]
    each = len(plan.sizes) + len(SLOW) * len(plan.slow_sizes) + 2 * len(plan.peers) + len(VIEW_FACTORS)
    total, done = len(plan.incident) * each, 0

    def step() -> None:
        nonlocal done
        done += 1
        report(min(done, total), total)

    for incident in plan.incident:
        for w in plan.sizes:
            runs.append(fit_in_child("auto", incident, w, device))
            step()
        largest_fit = max(runs, key=lambda run: (run.incident == incident, run.wavelengths))
        for method in SLOW:
            for w in plan.slow_sizes:
                runs.append(fit_in_child(method, incident, w, device))
                step()
        for name, budgets in plan.peers:
            for budget in budgets:
                peers.append(race_peer(name, incident, largest, budget, device))
                lowest = largest_fit.objective[peer_places(largest)]
                if found_share(peers[-1].objective, lowest) == 1.0:
                    break
            step()
            runs.append(fit_in_child("auto", incident, largest, device))
            step()
        for views in VIEW_FACTORS:
            runs.append(fit_in_child("auto", incident, middle, device, views))
            step()
    report(total, total)
    return runs, peers


def found_share(energy: Array, lowest: Array) -> float:
    """Share of energies (W,) within FOUND of the lowest known (W,)."""
    return float(np.mean(energy <= lowest * (1.0 + FOUND)))


def growth(runs: Sequence[Run], incident: int, wavelengths: int) -> float:
    """Ratio of median seconds per doubling, from the next smaller number of wavelengths to this one."""
    times = seconds_by_size(runs, incident)
    smaller = max(w for w in times if w < wavelengths)
    doublings = np.log2(wavelengths / smaller)
    return float((times[wavelengths] / times[smaller]) ** (1.0 / doublings))


def seconds_by_size(runs: Sequence[Run], incident: int, method: str = "auto") -> dict[int, float]:
    """Median seconds of the fits with the usual directions by W."""
    usual = [r for r in runs if r.method == method and r.incident == incident and r.directions == DIRECTIONS]
    sizes = sorted({r.wavelengths for r in usual})
    return {w: float(np.median([r.seconds for r in usual if r.wavelengths == w])) for w in sizes}

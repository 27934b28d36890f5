"""Time to fit W wavelengths: our methods, whole fits in processes of their own, beside peers per wavelength.

Peers minimise E in NumPy, fp64, with analytic derivatives, one wavelength after the other on one core, and
are timed on a few wavelengths, which scales; each gets the smallest of growing budgets with which it finds
the optimum at all of them. Found is within 1e-6 of the lowest E that anybody reached. The peers' runs lie
between ours, so that a machine that slows down slows both.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.memory import peak_memory
from clbrdf.errors import DeviceError
from clbrdf.fit.given import given_parameters
from clbrdf.fit.problem import make_problem
from clbrdf.geometry import Directions
from clbrdf.models import DEFAULT_MODEL, NEEDS_PHI, SIGNED, Model, get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.device import Device
from clbrdf.optimizers import minimise
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.parallel.children import follow_parent, run_child
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

CHUNK = 64
"""Wavelengths whose values are formed at once."""

NOISE = 0.02
LEAST = 1e-9
"""1/sr; no instrument sees less, and narrow lobes end far below what a fit takes for a value."""

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


def race_scan(incident: int, wavelengths: int, views: float = 1.0, model: str = DEFAULT_MODEL) -> Scan:
    """Return a noisy synthetic scan whose parameters change slowly with wavelength.

    Parameters
    ----------
    incident : int
        3 or 6 incident angles.
    wavelengths : int
        W, from 400 to 800 nm.
    views : float
        Factor on the number of view zeniths.
    model : str
        By its name.
    """
    chosen, rng = get_model(model), np.random.default_rng(2013)
    d = race_directions(incident, views)
    # A surface with a direction of its own is turned as well.
    phi_i = np.where(np.arange(len(d)) % 2, 0.0, 60.0) if chosen.flags & NEEDS_PHI else d.phi_i
    nm = np.linspace(400.0, 800.0, wavelengths)
    empty = Scan(d.theta_i, phi_i, d.theta_r, phi_i + d.phi, nm, np.ones((len(d), wavelengths)))
    sets = foil_like(nm) if chosen.name == DEFAULT_MODEL else drifting(chosen, nm)
    exact = np.empty(empty.brdf.shape)
    x = chosen.features(empty.directions)
    for first in range(0, wavelengths, CHUNK):
        part = slice(first, first + CHUNK)
        exact[:, part] = chosen.brdf(sets[part, None, :], x).T
    noisy = exact * (1.0 + NOISE * rng.standard_normal(exact.shape))
    if chosen.flags & SIGNED:  # values below zero are data where an uncertainty says so
        return replace(empty, brdf=noisy, sigma=NOISE * np.abs(exact).max(axis=0) * np.ones(exact.shape))
    return replace(empty, brdf=np.maximum(np.abs(noisy), LEAST))


def foil_like(nm: Array) -> Array:
    """Parameters (W, P) of wang2013 that are about those of a tin foil."""
    turn = 2.0 * np.pi * (nm - 400.0) / 400.0
    return get_model().vector(
        {
            "a": 3.87 + 0.3 * np.sin(turn),
            "b": 0.5216 + 0.02 * np.cos(turn),
            "c": -300.0 * (1.0 + 0.3 * np.sin(2.0 * turn)),
            "d": 0.74 + 0.02 * np.sin(turn),
            "ks": 300.0 + 150.0 * np.sin(0.5 * turn),
            "kd": 1.3 + 0.4 * np.cos(turn),
        }
    )


def drifting(model: Model, nm: Array) -> Array:
    """Parameters (W, P) about the defaults of a table, apart from each other and away from limits.

    Of equal parts the second has the wider shape.
    """
    turn = 2.0 * np.pi * (nm - 400.0) / 400.0
    second = {place for parts in model.equal_parts for part in parts[1:] for place in part}
    columns = []
    for j, row in enumerate(model.parameters):
        if row.given:
            columns.append(nm if row.given == "wavelength" else np.full(len(nm), row.default))
            continue
        low, high = np.sort(row.to_coordinate(np.array(row.bounds)))
        start = float(row.to_coordinate(row.default))
        span = high - low
        if j in second and not row.linear:
            start += 0.25 * span
        middle = np.clip(start, low + 0.1 * span, high - 0.1 * span)
        if row.linear:
            values = row.from_coordinate(start) * (0.8 + 0.15 * np.sin(turn + j))
            columns.append(np.clip(values, *row.bounds))
        else:
            columns.append(row.from_coordinate(middle + 0.04 * span * np.sin(turn + j)))
    return np.stack([np.asarray(column, dtype=np.float64) for column in columns], axis=1)


def told(model: Model) -> dict[str, float]:
    """Parameters that a fit has to be told, at their defaults."""
    return {row.name: row.default for row in model.parameters if row.given == "user"}


def race_directions(incident: int, views: float = 1.0) -> Directions:
    """Return the directions of a race: 3 or 6 incident angles, three azimuths, views times a factor."""
    count, spacing = VIEWS[incident]
    theta_i = np.linspace(30.0, 60.0, 3) if incident == 3 else np.linspace(10.0, 60.0, 6)
    theta_r = np.linspace(0.0, (count - 1) * spacing, round(count * views))
    i, phi, r = (grid.ravel() for grid in np.meshgrid(theta_i, AZIMUTHS, theta_r, indexing="ij"))
    return Directions.relative(i, r, phi)


@dataclass(frozen=True, eq=False)
class RaceRun:
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


def fit_in_child(
    method: str,
    incident: int,
    wavelengths: int,
    device: Device,
    views: float = 1.0,
    model: str = DEFAULT_MODEL,
) -> RaceRun:
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
        "model": model,
        "device": device.name,
    }
    ended = run_child(["-c", "from clbrdf.bench.fit_race import child; child()", json.dumps(task)])
    if ended.returncode != 0:
        last = ended.stderr.strip().splitlines()[-1:] or ["no message"]
        raise DeviceError(f"the fit of {wavelengths} wavelengths by {method} failed: {last[0]}")
    row = json.loads(ended.stdout)
    directions = row["directions"]
    return RaceRun(
        method, incident, directions, wavelengths, row["seconds"], row["peak"], np.array(row["objective"])
    )


def child() -> None:
    """Fit the scan that the command line tells; print seconds, peak memory and E as JSON."""
    from clbrdf.fit import fit
    from clbrdf.opencl.device import choose_device

    follow_parent()
    task: dict[str, Any] = json.loads(sys.argv[1])
    device, method = choose_device(task["device"]), task["method"]
    model = get_model(task["model"])
    scan = race_scan(task["incident"], task["wavelengths"], task["views"], task["model"])
    few = scan.columns(np.arange(min(4, task["wavelengths"])))
    fit(few, method=method, device=device, model=model, fix=told(model))
    start = time.perf_counter()
    result = fit(scan, method=method, device=device, model=model, fix=told(model))
    seconds = time.perf_counter() - start
    row = {"seconds": seconds, "peak": peak_memory(), "objective": result.objective.tolist()}
    print(json.dumps({**row, "directions": len(scan.theta_i)}))


def race_peer(
    name: str, incident: int, wavelengths: int, budget: int, device: Device, model: str = DEFAULT_MODEL
) -> PeerRun:
    """Let one peer fit some of the wavelengths of a race scan, evenly chosen, with one budget."""
    chosen = get_model(model)
    places = peer_places(wavelengths)
    scan = race_scan(incident, wavelengths, model=model).columns(places)
    given = given_parameters(scan, chosen, told(chosen))
    problem = make_problem(scan, weight_matrix(scan), chosen, chosen.bounds(), device, given)
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
class RacePlan:
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
    model : str
        By its name.
    """

    sizes: tuple[int, ...] = (16, 64, 256, 1024, 2048)
    slow_sizes: tuple[int, ...] = (16, 64)
    incident: tuple[int, ...] = (3, 6)
    peers: tuple[tuple[str, tuple[int, ...]], ...] = (*BUDGETS.items(), (DEFAULT_ANNEALING, (0,)))
    model: str = DEFAULT_MODEL


VIEW_FACTORS = (0.5, 2.0)
"""On the number of directions, for the growth with N; at a middle number of wavelengths."""

SLOW = ("tempering", "anneal-separable", "anneal")


def able_chains(model: str) -> tuple[str, ...]:
    """Return the methods that search by chains and work for a model."""
    chosen = get_model(model)
    some = any(not chosen.parameters[j].given for j in chosen.linear)
    return tuple(method for method in SLOW if some or method != "anneal-separable")


def run_race(plan: RacePlan, device: Device, report: Report = silent) -> tuple[list[RaceRun], list[PeerRun]]:
    """Run everything of a plan; the fits of the largest size before, between and after the peers."""
    runs: list[RaceRun] = []
    peers: list[PeerRun] = []
    largest, middle = max(plan.sizes), sorted(plan.sizes)[len(plan.sizes) // 2]
    slow = able_chains(plan.model)
    each = len(plan.sizes) + len(slow) * len(plan.slow_sizes) + 2 * len(plan.peers) + len(VIEW_FACTORS)
    total, done = len(plan.incident) * each, 0

    def step() -> None:
        nonlocal done
        done += 1
        report(min(done, total), total)

    for incident in plan.incident:
        for w in plan.sizes:
            runs.append(fit_in_child("auto", incident, w, device, model=plan.model))
            step()
        largest_fit = max(runs, key=lambda run: (run.incident == incident, run.wavelengths))
        for method in slow:
            for w in plan.slow_sizes:
                runs.append(fit_in_child(method, incident, w, device, model=plan.model))
                step()
        for name, budgets in plan.peers:
            for budget in budgets:
                peers.append(race_peer(name, incident, largest, budget, device, plan.model))
                lowest = largest_fit.objective[peer_places(largest)]
                if found_share(peers[-1].objective, lowest) == 1.0:
                    break
            step()
            runs.append(fit_in_child("auto", incident, largest, device, model=plan.model))
            step()
        for views in VIEW_FACTORS:
            runs.append(fit_in_child("auto", incident, middle, device, views, plan.model))
            step()
    report(total, total)
    return runs, peers


def found_share(energy: Array, lowest: Array) -> float:
    """Share of energies (W,) within FOUND of the lowest known (W,)."""
    return float(np.mean(energy <= lowest * (1.0 + FOUND)))


def growth(runs: Sequence[RaceRun], incident: int, wavelengths: int) -> float:
    """Ratio of median seconds per doubling, from the next smaller number of wavelengths to this one."""
    times = seconds_by_size(runs, incident)
    smaller = max(w for w in times if w < wavelengths)
    doublings = np.log2(wavelengths / smaller)
    return float((times[wavelengths] / times[smaller]) ** (1.0 / doublings))


def seconds_by_size(runs: Sequence[RaceRun], incident: int, method: str = "auto") -> dict[int, float]:
    """Median seconds of the fits with the usual directions by W."""
    usual = [r for r in runs if r.method == method and r.incident == incident and r.directions == DIRECTIONS]
    sizes = sorted({r.wavelengths for r in usual})
    return {w: float(np.median([r.seconds for r in usual if r.wavelengths == w])) for w in sizes}

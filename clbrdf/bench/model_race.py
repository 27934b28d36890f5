"""Whole fits of any model beside the peer that is the fastest to reach its optima.

The data are made from the model itself: each parameter moves smoothly with wavelength inside its limits,
and every value gets independent noise. The peer is SciPy's bounded least squares from random starts with
our NumPy derivatives: of the optimizers compared for wang2013 it is the fastest that finds all
(docs/decisions/0041).
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.bench.fit_race import BUDGETS, NOISE, found_share, peer_places, race_directions
from clbrdf.bench.memory import peak_memory
from clbrdf.device import Device
from clbrdf.errors import DeviceError
from clbrdf.fit.problem import make_problem
from clbrdf.models import Model, get_model
from clbrdf.objective import weight_matrix
from clbrdf.optimizers import minimise
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

PEER = "least-squares"

INSIDE = 0.1
"""Share of a coordinate's range that the truth stays away from its limits."""

MOVE = 0.05
"""Share of a coordinate's range by which the truth moves with wavelength."""

FITS = 3


@dataclass(frozen=True, eq=False)
class ModelRace:
    """One model: our fits, and the peer's.

    Attributes
    ----------
    model : str
    wavelengths, directions : int
    seconds : tuple of float
        Wall times of our fit of all wavelengths in one warm process.
    peak : float
        Largest resident memory of that process, bytes.
    found : float
        Share of the peer's wavelengths where ours is within `FOUND` of the lowest that anybody knows.
    budget : int
        Evaluations of the peer with which it found all, or its largest.
    peer_seconds : float
        Mean of a wavelength.
    peer_found : float
    """

    model: str
    wavelengths: int
    directions: int
    seconds: tuple[float, ...]
    peak: float
    found: float
    budget: int
    peer_seconds: float
    peer_found: float

    @property
    def milliseconds(self) -> float:
        """Of ours, a wavelength, median."""
        return 1e3 * float(np.median(self.seconds)) / self.wavelengths

    @property
    def ratio(self) -> float:
        """How many times as long the peer takes."""
        return 1e3 * self.peer_seconds / self.milliseconds


def race_model(name: str, wavelengths: int, device: Device) -> ModelRace:
    """Race one model.

    Raises
    ------
    DeviceError
        Our fit failed.
    """
    task = {"model": name, "wavelengths": wavelengths, "device": device.name}
    command = [sys.executable, "-P", "-c", "from clbrdf.bench.model_race import child; child()"]
    ended = subprocess.run([*command, json.dumps(task)], capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        last = ended.stderr.strip().splitlines()[-1:] or ["no message"]
        raise DeviceError(f"the fit of {wavelengths} wavelengths with {name} failed: {last[0]}")
    row = json.loads(ended.stdout)
    model, places = get_model(name), peer_places(wavelengths)
    scan, given = model_scan(model, wavelengths)
    ours = np.array(row["objective"])[places]
    budget, seconds, energy = _peer(model, scan.columns(places), given, device, ours)
    lowest = np.minimum(ours, energy)
    return ModelRace(
        model=name,
        wavelengths=wavelengths,
        directions=len(scan.theta_i),
        seconds=tuple(row["seconds"]),
        peak=row["peak"],
        found=found_share(ours, lowest),
        budget=budget,
        peer_seconds=seconds,
        peer_found=found_share(energy, lowest),
    )


def child() -> None:
    """Fit the scan that the command line tells; print seconds, peak memory and E as JSON."""
    from clbrdf.device import choose_device
    from clbrdf.fit import fit

    task: dict[str, Any] = json.loads(sys.argv[1])
    device, name = choose_device(task["device"]), task["model"]
    scan, given = model_scan(get_model(name), task["wavelengths"])
    fit(scan.columns(np.arange(min(4, task["wavelengths"]))), model=name, fix=given, device=device)
    seconds = []
    for _ in range(FITS):
        start = time.perf_counter()
        result = fit(scan, model=name, fix=given, device=device)
        seconds.append(time.perf_counter() - start)
    print(json.dumps({"seconds": seconds, "peak": peak_memory(), "objective": result.objective.tolist()}))


def model_scan(model: Model, wavelengths: int) -> tuple[Scan, dict[str, float]]:
    """Return a noisy scan of 774 directions, and the parameters that are given: those without a default."""
    d, rng = race_directions(3), np.random.default_rng(2013)
    nm = np.linspace(400.0, 800.0, wavelengths)
    given = {row.name: row.default for row in model.parameters if row.given == "user"}
    limits = model.coordinate_bounds(model.bounds())
    low, span = limits[:, 0], limits[:, 1] - limits[:, 0]
    centre = np.clip((model.to_coordinates(model.defaults) - low) / span, INSIDE, 1.0 - INSIDE)
    turn = 2.0 * np.pi * (nm[:, None] - 400.0) / 400.0 + np.arange(len(low))
    truth = model.from_coordinates(low + span * (centre + MOVE * np.sin(turn)))
    for j, row in enumerate(model.parameters):
        if row.given:
            truth[:, j] = nm if row.given == "wavelength" else row.default
    exact = model.brdf(truth[:, None, :], model.features(d)).T
    noisy = exact * (1.0 + NOISE * rng.standard_normal(exact.shape))
    return Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, nm, noisy, sigma=np.abs(NOISE * exact) + 1e-12), given


def _peer(
    model: Model, scan: Scan, given: dict[str, float], device: Device, ours: Array
) -> tuple[int, float, Array]:
    """Return the least budget with which the peer finds all, or its largest; its seconds and E."""
    known = {name: np.full(len(scan.wavelength), value) for name, value in given.items()}
    known |= {p.name: scan.wavelength for p in model.parameters if p.given == "wavelength"}
    problem = make_problem(scan, weight_matrix(scan), model, model.bounds(), device, known)
    for budget in BUDGETS[PEER]:
        seconds, energy = [], []
        for k in range(len(scan.wavelength)):
            objective = NumpyObjective(problem, k)
            start = time.perf_counter()
            trace = minimise(PEER, objective, evaluations=budget, seed=k)
            seconds.append(time.perf_counter() - start)
            energy.append(float(trace.best))
        if found_share(np.array(energy), np.minimum(ours, energy)) == 1.0:
            break
    return budget, float(np.mean(seconds)), np.array(energy)

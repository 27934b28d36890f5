"""Whole fits of any model beside the peer that is the fastest to reach its optima.

The data are made from the model itself: each parameter moves smoothly with wavelength inside its limits,
and every value gets independent noise. The peer is SciPy's bounded least squares from random starts with
our NumPy derivatives: of the optimizers compared for wang2013 it is the fastest that finds all
(docs/decisions/0041).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clbrdf.bench.fit_race import BUDGETS, fit_in_child, found_share, peer_places, race_peer
from clbrdf.opencl.device import Device

PEER = "least-squares"

INCIDENT = 3
"""Incident angles of the scans."""

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
    runs = [fit_in_child("auto", INCIDENT, wavelengths, device, model=name) for _ in range(FITS)]
    ours = runs[0].objective[peer_places(wavelengths)]
    for budget in dict(BUDGETS)[PEER]:
        peer = race_peer(PEER, INCIDENT, wavelengths, budget, device, name)
        lowest = np.minimum(ours, peer.objective)
        if found_share(peer.objective, lowest) == 1.0:
            break
    return ModelRace(
        model=name,
        wavelengths=wavelengths,
        directions=runs[0].directions,
        seconds=tuple(run.seconds for run in runs),
        peak=max(run.peak for run in runs),
        found=found_share(ours, lowest),
        budget=budget,
        peer_seconds=float(np.mean(peer.seconds)),
        peer_found=found_share(peer.objective, lowest),
    )

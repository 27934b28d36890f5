"""A grid that grows until the file is within a tolerance of its BRDF."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.rgl.accuracy import LAST_INCIDENT, Accuracy, measure_accuracy, random_incidents
from clbrdf.formats.rgl.incidence import Incidence, best_incidence
from clbrdf.formats.rgl.material import Material, Places
from clbrdf.formats.rgl.parametrise import AZIMUTHS, ZENITHS, TableLayout, lobe_profile, make_tables
from clbrdf.formats.rgl.tables import Tables, size_of
from clbrdf.formats.rgl.values import TensorReader
from clbrdf.progress import Report

Array = npt.NDArray[np.float64]

DEFAULT_TOLERANCE = 0.005
MOST_BYTES = 512 * 2**20
FIRST_COUNT, FIRST_SIDE = 10, 20
MOST_ROUNDS = 10
AIM = 0.88
"""Part of the tolerance that a grid is predicted to reach: predictions are not exact."""

GROWTH = 1.8
"""At most, in one round and for one of the two resolutions."""

PROBE_INCIDENTS, PROBE_VIEWS = 64, 256
FINAL_INCIDENTS, FINAL_VIEWS = 128, 384
SEARCH_SEED, FINAL_SEED = 1, 2
BEYOND_INCIDENTS = np.array([82.0, 85.0, 87.5])


@dataclass(frozen=True, eq=False)
class Export:
    """Tables within a tolerance, and how they came about.

    Attributes
    ----------
    tables : Tables
    accuracy : Accuracy
        On directions that the search has not seen.
    beyond : Accuracy
        At incident zeniths above those for which the tolerance holds.
    tolerance : float
    rounds : int
        Grids that were tried.
    seconds : float
    """

    tables: Tables
    accuracy: Accuracy
    beyond: Accuracy
    tolerance: float
    rounds: int
    seconds: float

    @property
    def incidents(self) -> int:
        """Stored incident zeniths."""
        return len(self.tables.theta_i)

    @property
    def side(self) -> int:
        """Samples of an incident zenith along each of two axes."""
        return int(self.tables.spectra.shape[-1])


def export_material(
    material: Material,
    tolerance: float = DEFAULT_TOLERANCE,
    report: Report | None = None,
    most_bytes: int = MOST_BYTES,
) -> Export:
    """Return the tables of an RGL file whose error is within a tolerance.

    The error is Σ|error| / Σ|f| over directions with θi from 3° to 80° and θr up to 85°, half of them
    around the mirror direction, at the worst wavelength; that of the reflected light over the hemisphere
    is at most three times as much (`accuracy`).

    Raises
    ------
    InputError
        A tolerance outside 0.0005 to 0.5, a BRDF that is nowhere positive, or a tolerance that no file of
        at most `most_bytes` keeps; the message says what was reached.
    """
    if not 0.0005 <= tolerance <= 0.5:
        raise InputError(f"tolerance is {tolerance:g}; it lies between 0.0005 (0.05 %) and 0.5 (50 %)")
    start = time.perf_counter()
    profile = lobe_profile(material)
    incidence = best_incidence(material, profile)
    search = _Search(material, incidence, profile, tolerance, most_bytes)
    probes = material.steering_bands
    count, side = FIRST_COUNT, FIRST_SIDE
    reached = np.inf
    for rounds in range(1, MOST_ROUNDS + 1):
        if report is not None:
            report(rounds, MOST_ROUNDS)
        if _bytes(count, side, material.bands) > most_bytes:
            break
        total, sampled = search.errors(count, side, probes)
        if total <= tolerance:
            layout = TableLayout(incidence.nodes(count), side)
            tables = make_tables(material, layout, profile)
            reader, bands = TensorReader(tables), material.every_band
            incidents = random_incidents(FINAL_INCIDENTS, FINAL_SEED)
            accuracy = measure_accuracy(material, reader, bands, incidents, FINAL_VIEWS, FINAL_SEED)
            reached = accuracy.binding
            if reached <= tolerance:
                beyond = measure_accuracy(material, reader, bands, BEYOND_INCIDENTS, FINAL_VIEWS, FINAL_SEED)
                seconds = time.perf_counter() - start
                return Export(tables, accuracy, beyond, tolerance, rounds, seconds)
            # A band that no probe stands for, or directions that the search has not seen.
            probes = np.union1d(probes, [int(np.argmax(accuracy.by_band))])
            sampled *= reached / total
            total = reached
        reached = total
        count, side = search.next(count, side, total, sampled)
    size = _bytes(count, side, material.bands) / 1e6
    raise InputError(
        f"a file within {100.0 * tolerance:g} % would take about {size:.0f} MB; {100.0 * reached:.2g} % was"
        " reached: allow a larger tolerance, or export fewer wavelengths or RGB"
    )


@dataclass(frozen=True, eq=False)
class _Search:
    material: Material
    incidence: Incidence
    profile: Array
    tolerance: float
    most_bytes: int

    def errors(self, count: int, side: int, probes: Places) -> tuple[float, float]:
        """Error of a grid, and the part of it that is there at stored incident zeniths, too."""
        nodes = self.incidence.nodes(count)
        tables = make_tables(self.material, TableLayout(nodes, side), self.profile, probes)
        reader = TensorReader(tables)
        incidents = random_incidents(PROBE_INCIDENTS, SEARCH_SEED)
        total = measure_accuracy(self.material, reader, probes, incidents, PROBE_VIEWS, SEARCH_SEED)
        stored = np.rad2deg(tables.theta_i.astype(np.float64))
        stored = stored[(stored > 1.0) & (stored <= LAST_INCIDENT)]
        sampled = measure_accuracy(self.material, reader, probes, stored, PROBE_VIEWS, SEARCH_SEED)
        return total.binding, min(sampled.binding, 0.9 * total.binding)

    def next(self, count: int, side: int, total: float, sampled: float) -> tuple[int, int]:
        """Return the smallest grid that is predicted to keep the tolerance.

        Both parts of the error fall with the square of their resolution.
        """
        a, b = (total - sampled) * count**2, sampled * side**2
        counts = np.arange(count, int(np.ceil(count * GROWTH)) + 1)[:, None]
        sides = np.arange(side, int(np.ceil(side * GROWTH)) + 1, 2)[None, :]
        predicted = a / counts**2 + b / sides**2
        size = counts * (AZIMUTHS * ZENITHS + (self.material.bands + 1) * sides**2)
        kept = predicted <= AIM * self.tolerance
        if kept.any():
            best = np.argmin(np.where(kept, size, np.inf))
        else:
            best = np.argmin(np.where(size > 0, predicted, np.inf))
        k, n = np.unravel_index(int(best), predicted.shape)
        if k == 0 and n == 0:
            return count + 2, side + 2
        return int(counts[k, 0]), int(sides[0, n])


def _bytes(count: int, side: int, bands: int) -> int:
    return 4 * count * (AZIMUTHS * ZENITHS + (bands + 1) * side**2)


def file_size(export: Export) -> int:
    """Bytes of the file, but for its head."""
    return size_of(export.tables)

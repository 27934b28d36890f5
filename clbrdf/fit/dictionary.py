"""A dictionary of lobes shared by all wavelengths: what enters linearly is solved, the rest looked up.

For a grid of lobe shapes, spectra are projected on each lobe by matrix products, incident direction by
incident direction, so that E (13) of any amplitudes A(θi) and any diffuse term follows from a few sums
without going back to the directions:

1. For every shape: the best non-negative amplitudes and diffuse term, closed form. They are free of the
   model's growth, so this E bounds that of the model from below, up to the spacing of the grid.
2. For the most promising shapes: growths that come near the amplitudes, and for each the best two linear
   parameters within their limits, closed form.
3. Of those, the lowest that lie apart from each other go to the polish.

No random numbers are drawn. Source of the separation: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.blocks import bytes_each, evaluations_each
from clbrdf.fit.polish import check_polish
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.fit.reduced import Sums, best_amplitudes, best_linear
from clbrdf.fit.thin import thinned
from clbrdf.models.structure import Structure
from clbrdf.progress import Report

Array = npt.NDArray[np.float64]

MOST_INCIDENT = 12
"""Incident directions with an amplitude of their own; where there are more, neighbours share one."""

MOST_DIRECTIONS = 512
"""On which spectra are projected; the polish takes all."""

THREADS = 4
"""At work on chunks of wavelengths; a fixed number, so that chunks do not depend on the machine."""

LEAST_CHUNK = 128
"""Wavelengths worth a thread."""

MOST_GROWTHS = 8
"""That are read off the amplitudes of one shape."""

CHUNK_BYTES = 32 << 20
"""Of the sums of one chunk of wavelengths."""

APART = 1.0 / 12.0
"""Starts lie at least this share of a coordinate's range apart in one coordinate."""

SMALLEST_DIFFUSE = 1e-3
"""Starts have at least this share of the mean BRDF as diffuse term: in its logarithm, 0 is out of reach."""

WEAK = 100.0
"""N (E without a lobe − E) / E below which a lobe hardly stands out of noise, where many fit about as well:
six parameters fitted to nothing but noise make it about 6."""

TYPICAL_PASSES = 60
"""Of the polish, each some three model evaluations: from these starts it needs 10 to 40."""

ROUNDING = 2.0**-24
"""Starts are rounded to this share of a coordinate's range, so that the last bits of a matrix product,
which depend on how many wavelengths it takes at once, do not reach the result."""


@dataclass(frozen=True)
class DictionarySettings:
    """How widely to look.

    Attributes
    ----------
    shapes : int
        Lobe shapes that are looked at with the model's growth.
    starts : int
        Starts of the polish.
    grid : bool
        Try a grid of growths as well as those read off the amplitudes.
    deepen : bool
        Look again, four times as widely and with the grid, where the ends of the polish disagree or the
        lobe hardly stands out of the noise.
    polish : "none", "single" or "double"
        How far the ends are polished; the usual way is to the last digit in double precision.
    everywhere : bool
        Search on all directions, however many; time and memory then grow with their number.
    """

    shapes: int = 16
    starts: int = 8
    grid: bool = False
    deepen: bool = True
    polish: str = "double"
    everywhere: bool = False

    def __post_init__(self) -> None:
        check_polish(self.polish)
        for name in ("shapes", "starts"):
            if not 1 <= getattr(self, name) <= 10_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 10000")

    def cost(self, directions: int, _parameters: int) -> tuple[int, int]:
        """Return bytes, and model evaluations of the longest launch, that one wavelength takes."""
        return bytes_each(directions), evaluations_each(directions, TYPICAL_PASSES * self.starts)

    def deeper(self) -> DictionarySettings | None:
        """Return the settings of the second look, None where there is none."""
        if not self.deepen:
            return None
        return replace(self, shapes=4 * self.shapes, starts=4 * self.starts, grid=True, deepen=False)


def search(problem: Problem, settings: DictionarySettings, _seed: int, report: Report) -> Candidates:
    """Look up starts for every wavelength of a problem whose model has a structure."""
    structure = problem.model.structure
    assert structure is not None  # get_method has seen to it
    if not settings.everywhere:
        problem = thinned(problem, MOST_DIRECTIONS)
    w = problem.size[0]
    limits = problem.model.value_bounds(problem.lower[0], problem.upper[0])
    places = problem.model.places
    shapes, grid_places = structure.shape_grid(problem.features, limits[places(structure.shape)])
    near = np.abs(grid_places[:, None] - grid_places[None]).max(axis=-1) <= 1
    lobes = structure.lobes(shapes, problem.features)
    incident = _incident_groups(problem)
    growths = len(structure.growth_grid(limits[places(structure.growth)])) if settings.grid else MOST_GROWTHS
    values = 6 * len(shapes) + 4 * settings.shapes * growths
    most = max(1, CHUNK_BYTES // (8 * values * (int(incident.max()) + 1)))
    size = min(most, max(LEAST_CHUNK, -(-w // THREADS)))

    def part(first: int) -> tuple[Array, npt.NDArray[np.bool_]]:
        rows = slice(first, min(first + size, w))
        return _look_up(problem, rows, settings, structure, limits, shapes, near, lobes, incident)

    parts = []
    with ThreadPoolExecutor(THREADS) as threads:  # NumPy lets go of Python's lock
        for found in threads.map(part, range(0, w, size)):
            parts.append(found)
            report(min(len(parts) * size, w), w)
    return Candidates(
        coordinates=np.concatenate([starts for starts, _ in parts]),
        evaluations=np.full(w, len(shapes), dtype=np.int64),
        acceptance=np.full(w, np.nan),
        not_finite=np.zeros(w, dtype=np.int64),
        doubtful=np.concatenate([weak for _, weak in parts]),
    )


def _incident_groups(problem: Problem) -> npt.NDArray[np.intp]:
    """Group (N,) of each direction by its incident direction, neighbours together where there are many."""
    starts = problem.starts.astype(np.intp)
    x = problem.features[starts[:-1], 0]
    rank = np.argsort(np.argsort(x, kind="stable"), kind="stable")
    label = rank * min(MOST_INCIDENT, len(x)) // len(x)
    return np.repeat(label, np.diff(starts))


def _look_up(
    problem: Problem,
    rows: slice,
    settings: DictionarySettings,
    structure: Structure,
    limits: Array,
    shapes: Array,
    near: npt.NDArray[np.bool_],
    lobes: Array,
    incident: npt.NDArray[np.intp],
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return starts (w, K, P) of some wavelengths, and where the lobe is weak (w,)."""
    model = problem.model
    sums = Sums.project(problem.target[rows], problem.scale[rows], lobes, incident)
    energy, amplitudes = best_amplitudes(sums)
    chosen = _lowest_apart(energy, near, min(settings.shapes, len(shapes)))
    sums, amplitudes = sums.take(chosen), np.take_along_axis(amplitudes, chosen[None], axis=2)

    groups = np.arange(incident.max() + 1)
    x = np.stack([problem.features[incident == g, : model.incident_features].mean(axis=0) for g in groups])
    # An amplitude of 0 has no logarithm: it counts as a hundredth of the largest, and as heavy as that.
    floor = 0.01 * amplitudes.max(axis=0)
    heights = np.maximum(np.maximum(amplitudes, floor), 1e-300)
    growth_limits = limits[model.places(structure.growth)]
    heaviness = np.moveaxis(heights**2 * sums.lobe_lobe, 0, -1)
    growths = structure.growths(np.moveaxis(np.log(heights), 0, -1), heaviness, x, growth_limits)
    if settings.grid:
        grid = structure.growth_grid(growth_limits)
        grid = np.broadcast_to(grid, (*growths.shape[:2], *grid.shape))
        growths = np.concatenate([growths, grid], axis=2)

    log_growth = np.moveaxis(structure.log_growth(growths, x), -1, 0)
    top = log_growth.max(axis=0)
    upper = limits[model.places(structure.linear), 1]
    with np.errstate(over="ignore"):
        most = upper[0] * np.exp(top)
    energy, weight, rest = best_linear(sums, np.exp(log_growth - top), most, upper[1] * structure.diffuse)

    mean = problem.target[rows].sum(axis=1) / problem.scale[rows].sum(axis=1)
    rest = np.maximum(rest, SMALLEST_DIFFUSE * mean[:, None, None])
    q = np.empty((len(model.parameters), *energy.shape))
    for k, place in enumerate(model.places(structure.shape)):
        q[place] = model.parameters[place].to_coordinate(shapes[chosen, k])[..., None]
    for k, place in enumerate(model.places(structure.growth)):
        q[place] = model.parameters[place].to_coordinate(growths[..., k])
    weight_place, rest_place = model.places(structure.linear)
    q[weight_place] = np.log2(np.maximum(weight, 1e-300)) - top * np.log2(np.e)
    q[rest_place] = model.parameters[rest_place].to_coordinate(rest / structure.diffuse)
    w = len(energy)
    lowest = energy.reshape(w, -1).min(axis=1)
    without = sums.data_data - sums.one_data.sum(axis=0) ** 2 / sums.one_one.sum(axis=0)
    weak = np.count_nonzero(problem.scale[rows], axis=1) * (without - lowest) < WEAK * lowest
    starts = _starts(problem, energy.reshape(w, -1), q.reshape(len(q), w, -1), settings.starts)
    return starts, weak


def _lowest_apart(energy: Array, near: npt.NDArray[np.bool_], count: int) -> npt.NDArray[np.intp]:
    """Places (w, count) of the lowest of energies (w, K), no two of them near (K, K) each other."""
    open_energy, out = energy.copy(), []
    for _ in range(count):
        lowest = open_energy.argmin(axis=1)
        out.append(lowest)
        open_energy[near[lowest]] = np.inf
    return np.stack(out, axis=1)


def _starts(problem: Problem, energy: Array, q: Array, count: int) -> Array:
    """Coordinates (w, count, P) of the lowest of candidates (P, w, C) that lie apart from each other."""
    lower, upper = problem.lower[0], problem.upper[0]
    low, span = lower[:, None, None], (upper - lower)[:, None, None]
    span = np.where(span > 0.0, span, 1.0)
    unit = np.round(np.clip((q - low) / span, 0.0, 1.0) / ROUNDING) * ROUNDING
    rows, open_energy, out = np.arange(len(energy)), np.where(np.isfinite(energy), energy, np.inf), []
    for _ in range(count):
        lowest = unit[:, rows, open_energy.argmin(axis=1)]
        out.append(lowest.T)
        near = np.ones(open_energy.shape, dtype=np.bool_)
        for coordinate, chosen in zip(unit, lowest, strict=True):
            near &= np.abs(coordinate - chosen[:, None]) < APART
        open_energy[near] = np.inf
    starts: Array = lower + (upper - lower) * np.stack(out, axis=1)
    return starts

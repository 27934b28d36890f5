"""Starts for any model: shapes that all wavelengths share, the linear parameters solved on the device.

Up to two nonlinear parameters are covered by a grid, more by a low-discrepancy set (Sobol' 1967); of parts
that are equal the first has the smaller shape, since a swap changes nothing. The lowest that lie apart from
each other go to the polish. No random numbers are drawn. The sums are those of `kernels/lookup.cl` or, where
no linear parameter is free, of `kernels/lookup_together.cl`, formed in single precision from residuals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.blocks import bytes_each, evaluations_each
from clbrdf.fit.chains import free_linear, search_library
from clbrdf.fit.parts import in_order
from clbrdf.fit.polish import check_polish
from clbrdf.fit.problem import Candidates, Problem
from clbrdf.fit.thin import thinned
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import Variant, build, upload, work_group
from clbrdf.progress import Report

Array = npt.NDArray[np.float64]

GRID = {1: 64, 2: 24}
"""Values of each of one or two nonlinear parameters."""

LOOKED_AT = 256
"""Of the lowest shapes, among which the starts are chosen."""

APART = 1.0 / 12.0
"""Starts lie at least this share of a coordinate's range apart in one nonlinear coordinate."""

MOST_DIRECTIONS = 256
"""That the look-up sums over; the polish takes all."""

FEW = 3
"""Nonlinear parameters up to which the settings hold as they are. For each further one, up to MOST_DOUBLINGS,
there are twice as many shapes: in coarser sets the lowest basin may have no point (Hapke's model). There are
twice as many starts, too, and all of them are asked: the eight lowest may agree on a higher end."""

MOST_DOUBLINGS = 2

FIRST = 4
"""Starts that go to the end first, for few nonlinear parameters: where they come to one optimum, the others
are not asked."""

TOGETHER = 8
"""Wavelengths for which a value is formed once, as in kernels/lookup_together.cl."""

ROUGH_ITERATIONS = 32
"""Of the way in single precision: sums of models have long valleys, and a start that is given up after the
usual dozen may be the one that leads to the lowest end (wang2013+eon)."""

TYPICAL_PASSES = 60
"""Of the polish, each some three model evaluations."""


@dataclass(frozen=True)
class LookupSettings:
    """How widely to look.

    Attributes
    ----------
    shapes : int
        Points of the low-discrepancy set, rounded up to a power of 2, for up to FEW nonlinear parameters;
        twice as many for each further one, up to MOST_DOUBLINGS. A grid grows with its root.
    starts : int
        Starts of the polish; twice as many for more than FEW nonlinear parameters.
    deepen : bool
        Look again, four times as widely, where the ends of the polish disagree.
    polish : "none", "single" or "double"
        How far the ends are polished; the usual way is to the last digit in double precision.
    everywhere : bool
        Search on all directions, however many; time and memory then grow with their number.
    """

    shapes: int = 1024
    starts: int = 12
    deepen: bool = True
    polish: str = "double"
    everywhere: bool = False

    def __post_init__(self) -> None:
        check_polish(self.polish)
        for name in ("shapes", "starts"):
            if not 1 <= getattr(self, name) <= 100_000:
                raise InputError(f"{name} is {getattr(self, name)}; give 1 to 100000")

    def cost(self, directions: int, _parameters: int) -> tuple[int, int]:
        """Return bytes, and model evaluations of the longest launch, that one wavelength takes."""
        shapes = self.shapes << MOST_DOUBLINGS
        passes = max(shapes, 2 * TYPICAL_PASSES * self.starts)
        return bytes_each(directions) + 64 * shapes, evaluations_each(directions, passes)

    def deeper(self) -> LookupSettings | None:
        """Return the settings of the second look, None where there is none."""
        if not self.deepen:
            return None
        return replace(self, shapes=4 * self.shapes, starts=4 * self.starts, deepen=False)


def search(problem: Problem, settings: LookupSettings, _seed: int, report: Report) -> Candidates:
    """Look up starts for every wavelength of a problem.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernel.
    """
    w = problem.size[0]
    shapes = shape_set(problem, settings.shapes)
    energy, linear = look_up(problem if settings.everywhere else thinned(problem, MOST_DIRECTIONS), shapes)
    report(1, 1)
    searched = [j for j in problem.free if j not in problem.model.linear]
    unit = _unit(problem, shapes)[:, searched]
    many = len(searched) > FEW
    count = min(2 * settings.starts if many else settings.starts, len(shapes))
    chosen = _lowest_apart(np.nan_to_num(energy, nan=np.inf), unit, count)
    starts = np.repeat(problem.lower[:, None], count, axis=1)
    starts[..., searched] = shapes[chosen][..., searched]
    for k, place in enumerate(free_linear(problem)):
        starts[..., place] = np.take_along_axis(linear[..., k], chosen, axis=1)
    return Candidates(
        coordinates=np.clip(starts, problem.lower[:, None], problem.upper[:, None]),
        evaluations=np.full(w, len(shapes), dtype=np.int64),
        acceptance=np.full(w, np.nan),
        not_finite=np.count_nonzero(np.isnan(energy), axis=1).astype(np.int64),
        doubtful=np.zeros(w, dtype=np.bool_),
        first=0 if many else FIRST,
        rough_iterations=ROUGH_ITERATIONS,
        off_limits=settings.deepen,
    )


def shape_set(problem: Problem, size: int) -> Array:
    """Return coordinates (K, P): nonlinear ones cover their limits, the others are at the lower one."""
    lower, upper = problem.lower[0], problem.upper[0]
    searched = [j for j in problem.free if j not in problem.model.linear]
    d = len(searched)
    if d == 0:
        return np.asarray(lower[None])
    if d in GRID:
        count = round(GRID[d] * (size / LookupSettings().shapes) ** (1.0 / d))
        axis = (np.arange(count) + 0.5) / count
        unit = np.stack(np.meshgrid(*[axis] * d, indexing="ij"), axis=-1).reshape(-1, d)
    else:
        from scipy.stats import qmc

        doublings = min(max(0, d - FEW), MOST_DOUBLINGS)
        power = max(0, int(np.ceil(np.log2(size)))) + doublings
        unit = qmc.Sobol(d, scramble=False).random_base2(power)
        # The set begins in the corner of the box, where no optimum is expected.
        unit = np.mod(unit + 0.5 / len(unit), 1.0)
    out = np.repeat(lower[None], len(unit), axis=0)
    out[:, searched] = lower[searched] + unit * (upper - lower)[searched]
    known = np.array([j not in problem.free for j in range(len(lower))])
    return in_order(problem.model, out, np.stack([lower, upper], axis=1), known)


def look_up(problem: Problem, shapes: Array) -> tuple[Array, Array]:
    """Return log2 E (W, K) at shapes (K, P), and the linear coordinates (W, K, L) solved there."""
    import pyopencl as cl

    device, precision = problem.device, get_precision("fast:6")
    solved = free_linear(problem)
    if not solved and (problem.lower == problem.lower[0]).all():
        return _look_up_together(problem, shapes), np.empty((*problem.size[:1], len(shapes), 0))
    library = ("coordinates", "objective", *search_library(bool(solved)))
    variant = Variant.on(device, "lookup", problem.model, precision, library, free=problem.free)
    kernel, queue = cl.Kernel(build(device, variant), "lookup"), open_queue(device)
    (w, n), k, width = problem.size, len(shapes), variant.lanes.width
    dtype, lanes = precision.dtype, _in_lanes(shapes, width)
    groups = len(lanes)
    energy = np.empty((w, groups, width), dtype)
    linear = np.empty((w, groups, max(1, len(solved)), width), dtype)
    out = [cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes) for host in (energy, linear)]
    kernel(
        *(queue, (groups, w), work_group(device, 2)),
        *(upload(device, problem.features, dtype), upload(device, problem.starts)),
        *(np.uint32(len(problem.starts) - 1), np.uint32(n)),
        *(upload(device, a, dtype) for a in (problem.target, problem.scale, problem.lower, problem.upper)),
        *(upload(device, lanes, dtype), *out),
    )
    for host, buffer in zip((energy, linear), out, strict=True):
        cl.enqueue_copy(queue, host, buffer)
    solutions = linear.transpose(0, 1, 3, 2).reshape(w, groups * width, -1)[:, :k, : len(solved)]
    return energy.reshape(w, -1)[:, :k].astype(np.float64), solutions.astype(np.float64)


def _look_up_together(problem: Problem, shapes: Array) -> Array:
    """Return log2 E (W, K) at shapes (K, P) at which the model's values are those of all wavelengths."""
    import pyopencl as cl

    device, precision = problem.device, get_precision("fast:6")
    library = ("coordinates", "objective")
    variant = Variant.on(device, "lookup_together", problem.model, precision, library, free=problem.free)
    kernel, queue = cl.Kernel(build(device, variant), "lookup_together"), open_queue(device)
    dtype, lanes, (w, n) = precision.dtype, _in_lanes(shapes, variant.lanes.width), problem.size
    energy = np.empty((w, len(lanes), variant.lanes.width), dtype)
    out = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, energy.nbytes)
    kernel(
        *(queue, (len(lanes), -(-w // TOGETHER)), work_group(device, 2)),
        *(upload(device, problem.features, dtype), upload(device, problem.starts)),
        *(np.uint32(len(problem.starts) - 1), np.uint32(n), np.uint32(w)),
        *(upload(device, a, dtype) for a in (problem.target, problem.scale, problem.lower[0], lanes)),
        out,
    )
    cl.enqueue_copy(queue, energy, out)
    return energy.reshape(w, -1)[:, : len(shapes)].astype(np.float64)


def _in_lanes(shapes: Array, width: int) -> Array:
    """Return shapes (K, P) as lanes of vectors, (K / width, P, width); lanes to spare begin again."""
    groups = -(-len(shapes) // width)
    places = np.arange(groups * width) % len(shapes)
    return shapes[places].reshape(groups, width, -1).transpose(0, 2, 1)


def _unit(problem: Problem, coordinates: Array) -> Array:
    """Coordinates as shares of their ranges."""
    span = problem.upper[0] - problem.lower[0]
    out: Array = (coordinates - problem.lower[0]) / np.where(span > 0.0, span, 1.0)
    return out


def _lowest_apart(energy: Array, unit: Array, count: int) -> npt.NDArray[np.intp]:
    """Places (W, count) of the lowest of energies (W, K) whose coordinates (K, D) lie apart from each other.

    Where fewer lie apart, the lowest of the others follow.
    """
    most = min(energy.shape[1], max(LOOKED_AT, 2 * count))
    best = np.argsort(energy, axis=1, kind="stable")[:, :most]
    where, rows = unit[best], np.arange(len(best))
    apart_from_all = np.ones(best.shape, dtype=np.bool_)
    rank, out = np.broadcast_to(np.arange(most), best.shape), []
    taken = np.zeros(best.shape, dtype=np.bool_)
    for _ in range(count):
        # The first that lies apart; where there is none, the first that was not taken.
        place = np.where(taken, 2 * most, np.where(apart_from_all, rank, most + rank)).argmin(axis=1)
        out.append(best[rows, place])
        taken[rows, place] = True
        apart_from_all &= (np.abs(where - where[rows, place][:, None]) >= APART).any(axis=-1)
    return np.stack(out, axis=1)

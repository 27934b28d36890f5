"""From good starts to a stationary point: bounded Levenberg–Marquardt, batched in a kernel.

Most of the way goes in single precision, where a vector holds twice the lanes; ends that are then clearly
higher than the lowest stay where they are, and the others go on in double precision to the last digit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.device import open_queue
from clbrdf.errors import InputError
from clbrdf.fit.batch import batch_objective
from clbrdf.fit.problem import Problem
from clbrdf.precision import Precision, get_precision
from clbrdf.program import Variant, build, upload, work_group

Array = npt.NDArray[np.float64]

MOST_ITERATIONS = 300
TOLERANCE = 1e-14
"""Stop where a step would lower E by less than this, relative: below it rounding decides."""

ROUGH_ITERATIONS = 12
ROUGH_TOLERANCE = 1e-3
"""Of the way in single precision, whose E is good to about 1e-6, or to 1e-3 where E is below 1e-9."""

CLEARLY_HIGHER = 1.1
"""Ends of the first way above this many times the lowest are given up."""


DEPTHS = ("none", "single", "double")
"""How far a polish goes: not at all, to what single precision can tell, to the last digit."""


@dataclass(frozen=True, eq=False)
class Polished:
    """Ends of the polish, for W wavelengths and K starts.

    Attributes
    ----------
    coordinates : (W, K, P) float64
    objective : (W, K) float64
        E at the ends.
    evaluations : (W, K) int64
        Passes over the directions.
    converged : (W, K) bool
        Stopped at a stationary point, not by the limit on iterations.
    """

    coordinates: Array
    objective: Array
    evaluations: npt.NDArray[np.int64]
    converged: npt.NDArray[np.bool_]


def check_polish(depth: str) -> None:
    """Raise InputError where a depth is none of DEPTHS."""
    if depth not in DEPTHS:
        raise InputError(f"polish is {depth!r}; give one of {', '.join(DEPTHS)}")


def polish(problem: Problem, starts: Array, depth: str = "double") -> Polished:
    """Polish starts (W, K, P) at their wavelengths; those given up on the way keep E of single precision.

    Raises
    ------
    DeviceError
        The device has no fp64, or cannot build or run the kernel.
    """
    if depth == "none":
        return _judged(problem, starts, np.ones(starts.shape[:2], dtype=np.int64))
    rough = descend(problem, starts, get_precision("fast:6"), ROUGH_ITERATIONS, ROUGH_TOLERANCE)
    usable = np.isfinite(rough.objective)
    energy = np.where(usable, rough.objective, np.inf)
    q = np.where(usable[..., None], rough.coordinates, starts)
    given_up = (energy > CLEARLY_HIGHER * energy.min(axis=1, keepdims=True)) & usable
    if depth == "single":
        return _judged(problem, q, rough.evaluations + 1)
    # The lowest side by side: lanes of one vector then need about as many steps.
    order = np.argsort(energy, axis=1, kind="stable")
    q, given_up = np.take_along_axis(q, order[..., None], axis=1), np.take_along_axis(given_up, order, axis=1)
    fine = descend(problem, q, get_precision("double"), MOST_ITERATIONS, TOLERANCE, given_up)
    return Polished(
        coordinates=np.where(given_up[..., None], q, fine.coordinates),
        objective=np.where(given_up, np.take_along_axis(energy, order, axis=1), fine.objective),
        evaluations=np.take_along_axis(rough.evaluations, order, axis=1) + fine.evaluations,
        converged=fine.converged & ~given_up,
    )


def _judged(problem: Problem, ends: Array, evaluations: npt.NDArray[np.int64]) -> Polished:
    """Return ends (W, K, P) as they are, with their E in double precision."""
    energy = batch_objective(problem, problem.model.from_coordinates(ends), get_precision("double"))
    return Polished(ends, energy, evaluations, np.zeros(energy.shape, dtype=np.bool_))


def descend(
    problem: Problem,
    starts: Array,
    precision: Precision,
    most_iterations: int,
    tolerance: float,
    left_out: npt.NDArray[np.bool_] | None = None,
) -> Polished:
    """Descend from starts (W, K, P) in one precision; those `left_out` (W, K) are not touched.

    Raises
    ------
    DeviceError
        The device does not have the precision, or cannot build or run the kernel.
    """
    import pyopencl as cl

    device, dtype = problem.device, precision.dtype
    variant = Variant.on(device, "polish", problem.model, precision, ("coordinates",), free=problem.free)
    kernel, queue = cl.Kernel(build(device, variant), "polish"), open_queue(device)
    (w, n), k, p = problem.size, starts.shape[1], starts.shape[2]
    groups, width = -(-k // variant.lanes.width), variant.lanes.width
    # Lanes without a start of their own repeat the first, and stay where they are.
    places = np.where(np.arange(groups * width) < k, np.arange(groups * width), 0)
    lanes = starts[:, places].reshape(w, groups, width, p).transpose(0, 1, 3, 2)
    done = np.ones((w, groups * width), dtype=dtype)
    done[:, :k] = 0.0 if left_out is None else left_out

    def in_and_out(values: npt.NDArray[np.floating]) -> cl.Buffer:
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        return cl.Buffer(queue.context, flags, hostbuf=np.ascontiguousarray(values, dtype=dtype))

    q, ends = in_and_out(lanes), [in_and_out(values) for values in (0.0 * done, 0.0 * done, done)]
    rows, groups_of_rows = upload(device, problem.features, dtype), upload(device, problem.starts)
    data = [upload(device, a, dtype) for a in (problem.target, problem.scale, problem.lower, problem.upper)]
    sizes = np.uint32(len(problem.starts) - 1), np.uint32(n)
    kernel(
        *(queue, (groups, w), work_group(device, 2), rows, groups_of_rows, *sizes),
        *(*data, np.uint32(most_iterations), dtype(tolerance), q, *ends),
    )
    host_q = np.empty((w, groups, p, width), dtype=dtype)
    host_ends = [np.empty((w, groups * width), dtype=dtype) for _ in range(3)]
    for host, buffer in zip((host_q, *host_ends), (q, *ends), strict=True):
        cl.enqueue_copy(queue, host, buffer)
    objective, iterations, stopped = (a[:, :k] for a in host_ends)
    ends_q = host_q.transpose(0, 1, 3, 2).reshape(w, groups * width, p)[:, :k].astype(np.float64)
    return Polished(
        # The limits themselves may not be numbers of single precision.
        coordinates=np.clip(ends_q, problem.lower[:, None], problem.upper[:, None]),
        objective=objective.astype(np.float64),
        evaluations=iterations.astype(np.int64),
        converged=stopped > 0.0,
    )

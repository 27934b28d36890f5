"""From good starts to a stationary point: bounded Levenberg–Marquardt, batched in a kernel.

Most of the way goes in single precision, where a vector holds twice the lanes, and on some of the directions;
ends that are then clearly higher than the lowest stay where they are. The others go on on all directions: a
crowd of them in single precision, and what is left of it, or few, in double. That goes in rounds: after each,
an end that has come as low as the lowest has told what it can, and the lowest alone goes on to the last
digit, together with those that may still fall below it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.objectives import batch_objective
from clbrdf.fit.problem import Problem
from clbrdf.fit.seen import library_of, upload_seen
from clbrdf.fit.thin import measured_enough, on_sample, thin_sample
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.precision import Precision, get_precision
from clbrdf.opencl.program import Variant, build, upload, work_group

Array = npt.NDArray[np.float64]

ROUNDS = (6, 8, 16, 32, 64, 174)
"""Iterations of each round in double precision."""

MOST_ITERATIONS = sum(ROUNDS)
TOLERANCE = 1e-14
"""Stop where a step would lower E by less than this, relative: below it rounding decides."""

ROUGH_ITERATIONS = 12
ROUGH_TOLERANCE = 1e-3
"""Of the way in single precision, whose E is good to about 1e-6, or to 1e-3 where E is below 1e-9."""

ROUGH_DIRECTIONS = 256
"""On which that way goes where there are more."""

LEAST_MEASURED = 128
"""Of them that have to be measured at a wavelength, or as many as there are in all: else it goes on all."""

WORTH = 2.0
"""Ends of a way on some directions above this many times the lowest E there are given up."""

FIRST_DAMPING = 1e-3
"""Of the Levenberg–Marquardt system, scaled to a unit diagonal."""

NEAR_DAMPING = 1e-6
"""From starts that are known to be near the optimum."""

AS_LOW = 1e-6
"""Ends within this share of the lowest E have come to the same optimum."""

EXACT = 1e-24
"""E below this is rounding: all such ends are as low as the lowest."""

CLEARLY_HIGHER = 1.1
"""Ends above this many times the lowest are given up, where E is that of all directions."""

NEAR, ALIKE = 1e-2, 1e-3
"""Ends of the first way within these shares of each coordinate's range, and of E, have come together."""

CROWD = 8
"""Ends of a wavelength, as many as a vector of doubles often holds, beyond which they go on in single
precision before they do so in double: most of a crowd come to the same end (0124)."""

CROWD_ITERATIONS = 64
CROWD_TOLERANCE = 1e-6
"""As far as E of single precision can tell."""

FEW_ENDS = 2
"""Up to so many ends of a wavelength go on beside those of others, more beside each other."""

MOST_TWINNED = 4
"""Different ends, the lowest first, whose twins are looked for."""

DEPTHS = ("none", "single", "double")
"""How far a polish goes: not at all, to what single precision can tell, to the last digit."""


@dataclass(frozen=True, eq=False)
class Polished:
    """Ends of the polish, for W wavelengths and K starts.

    Attributes
    ----------
    coordinates : (W, K, P) float64
    objective : (W, K) float64
        E at the ends; infinite for those that were not asked because the first had agreed.
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


def polish(
    problem: Problem,
    starts: Array,
    depth: str = "double",
    first: int = 0,
    rough_iterations: int = 0,
    everywhere: bool = False,
) -> Polished:
    """Polish starts (W, K, P) at their wavelengths; those given up on the way have no E.

    With `first`, so many of the lowest go to the end before the others; where they all come to the same
    optimum, the others stay where they are. `rough_iterations` replaces ROUGH_ITERATIONS, where it is not 0.
    With `everywhere` the way in single precision, too, goes on all directions.

    Raises
    ------
    DeviceError
        The device has no fp64, or cannot build or run the kernel.
    """
    if depth == "none":
        return left_as_they_are(problem, starts, np.ones(starts.shape[:2], dtype=np.int64))
    rough, worth = _rough(problem, starts, rough_iterations or ROUGH_ITERATIONS, everywhere)
    usable = np.isfinite(rough.objective)
    energy = np.where(usable, rough.objective, np.inf)
    q = np.where(usable[..., None], rough.coordinates, starts)
    given_up = (energy > worth[:, None] * energy.min(axis=1, keepdims=True)) & usable
    if depth == "single":
        return left_as_they_are(problem, q, rough.evaluations + 1)
    ends = Polished(q, np.where(given_up, np.inf, energy), rough.evaluations, np.zeros_like(given_up))
    twin_of = _twins(problem, q, energy, ~given_up)
    all_at_once = not 0 < first < starts.shape[1]
    if all_at_once:
        ends, twin_of, given_up = _crowds_on(problem, ends, twin_of, given_up)
    alone = ~given_up & (twin_of == np.arange(starts.shape[1]))
    if all_at_once:
        return _with_twins(_to_the_end(problem, ends, alone, np.zeros_like(given_up)), twin_of)
    rank = np.argsort(np.argsort(energy, axis=1, kind="stable"), axis=1, kind="stable")
    early = ~given_up & (rank < first)
    ends = _to_the_end(problem, ends, early & alone, np.zeros_like(given_up))
    low = _as_low(_with_twins(ends, twin_of).objective, early)
    agreed = (low == early).all(axis=1, keepdims=True)
    ends = _with_twins(_to_the_end(problem, ends, alone & ~early & ~agreed, early & alone), twin_of)
    # E of single precision may round below that of double: it is no match for it.
    unasked = ~given_up & ~early & agreed
    return replace(ends, objective=np.where(unasked, np.inf, ends.objective))


def _rough(problem: Problem, starts: Array, iterations: int, everywhere: bool) -> tuple[Polished, Array]:
    """Return the ends of the way in single precision, and up to how many times the lowest E they are kept."""
    precision, n = get_precision("fast:6"), problem.size[1]
    if everywhere or n <= ROUGH_DIRECTIONS:
        ends = descend(problem, starts, precision, iterations, ROUGH_TOLERANCE)
        return ends, np.full(len(starts), CLEARLY_HIGHER)
    few = on_sample(problem, thin_sample(problem, ROUGH_DIRECTIONS))
    enough = measured_enough(problem, few, LEAST_MEASURED)
    ends = descend(few, starts, precision, iterations, ROUGH_TOLERANCE)
    rows = np.flatnonzero(~enough)
    if len(rows):
        all_of_them = descend(problem.take(rows), starts[rows], precision, iterations, ROUGH_TOLERANCE)
        for field in fields(Polished):
            getattr(ends, field.name)[rows] = getattr(all_of_them, field.name)
    return ends, np.where(enough, WORTH, CLEARLY_HIGHER)


def _crowds_on(
    problem: Problem, ends: Polished, twin_of: npt.NDArray[np.intp], given_up: npt.NDArray[np.bool_]
) -> tuple[Polished, npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Take ends on in single precision, on all directions, at wavelengths that have a crowd of them.

    Most have then come together. Returned are ends, twins and which are given up, as they were given.
    """
    alone = ~given_up & (twin_of == np.arange(twin_of.shape[1]))
    crowded = alone & (alone.sum(axis=1) > CROWD)[:, None]
    if not crowded.any():
        return ends, twin_of, given_up
    at = Polished(*(getattr(ends, field.name).copy() for field in fields(Polished)))
    _ends_side_by_side(problem, at, crowded, get_precision("fast:6"), CROWD_ITERATIONS, CROWD_TOLERANCE)
    failed = crowded & ~np.isfinite(at.objective)
    energy = np.where(crowded & ~failed, at.objective, np.inf)
    higher = np.isfinite(energy) & (energy > CLEARLY_HIGHER * energy.min(axis=1, keepdims=True))
    energy[higher] = np.inf
    q = np.where(failed[..., None], ends.coordinates, at.coordinates)
    twin = _twins(problem, q, energy, np.isfinite(energy))
    ends = replace(
        ends, coordinates=q, objective=np.where(crowded, energy, ends.objective), evaluations=at.evaluations
    )
    return ends, np.take_along_axis(twin, twin_of, axis=1), given_up | higher


def _twins(problem: Problem, q: Array, energy: Array, asked: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Return for each end (W, K) of the first way the place of the lowest end that it has come together with.

    Its own where there is none: so near each other, with E so alike, ends go on to the same optimum.
    """
    free = np.array(problem.free, dtype=np.intp)
    span = np.maximum(problem.upper - problem.lower, 1e-300)[:, None, free]
    rows, left = np.arange(len(q)), np.where(asked, energy, np.inf)
    twin_of = np.broadcast_to(np.arange(q.shape[1]), energy.shape).copy()
    for _ in range(MOST_TWINNED):
        best = left.argmin(axis=1)
        near = (np.abs(q[..., free] - q[rows, best][:, None, free]) <= NEAR * span).all(axis=-1)
        alike = left <= left[rows, best][:, None] * (1.0 + ALIKE)
        same = near & alike & np.isfinite(left)
        twin_of = np.where(same, best[:, None], twin_of)
        left = np.where(same, np.inf, left)
    return twin_of


def _with_twins(ends: Polished, twin_of: npt.NDArray[np.intp]) -> Polished:
    """Return ends of which each is that of its twin."""
    return Polished(
        coordinates=np.take_along_axis(ends.coordinates, twin_of[..., None], axis=1),
        objective=np.take_along_axis(ends.objective, twin_of, axis=1),
        evaluations=ends.evaluations,
        converged=np.take_along_axis(ends.converged, twin_of, axis=1),
    )


def _to_the_end(
    problem: Problem,
    ends: Polished,
    moving: npt.NDArray[np.bool_],
    done: npt.NDArray[np.bool_],
) -> Polished:
    """Descend in double precision, round by round, from the ends `moving`; those `done` are at their own."""
    rows, asked = np.arange(len(moving)), moving | done
    for iterations in ROUNDS:
        if not moving.any():
            break
        ends = Polished(*(getattr(ends, field.name).copy() for field in fields(Polished)))
        # Which wavelengths go which way is a matter of each alone, so that its neighbours do not change it.
        count = moving.sum(axis=1)
        _ends_across(problem, ends, moving & (count <= FEW_ENDS)[:, None], iterations)
        beside = moving & (count > FEW_ENDS)[:, None]
        _ends_side_by_side(problem, ends, beside, get_precision("double"), iterations, TOLERANCE)
        objective = ends.objective
        judged = np.where(asked & np.isfinite(objective), objective, np.inf)
        resting = _as_low(objective, asked) | (judged > CLEARLY_HIGHER * judged.min(axis=1, keepdims=True))
        resting[rows, judged.argmin(axis=1)] = False
        moving = moving & ~ends.converged & ~resting
    return ends


def _ends_across(problem: Problem, ends: Polished, moving: npt.NDArray[np.bool_], iterations: int) -> None:
    """Take each moving end on in a lane of its own, beside those of other wavelengths; write into `ends`."""
    w, k = np.nonzero(moving)
    if len(w) == 0:
        return
    part = problem if np.array_equal(w, np.arange(problem.size[0])) else problem.take(w)
    at = descend(part, ends.coordinates[w, k][:, None], get_precision("double"), iterations, TOLERANCE)
    ends.coordinates[w, k], ends.objective[w, k] = at.coordinates[:, 0], at.objective[:, 0]
    ends.evaluations[w, k] += at.evaluations[:, 0]
    ends.converged[w, k] = at.converged[:, 0]


def _ends_side_by_side(
    problem: Problem,
    ends: Polished,
    moving: npt.NDArray[np.bool_],
    precision: Precision,
    iterations: int,
    tolerance: float,
) -> None:
    """Take the moving ends of each wavelength on side by side; write into `ends`."""
    rows = np.flatnonzero(moving.any(axis=1))
    if len(rows) == 0:
        return
    # The lowest first: lanes of one vector then need about as many steps.
    order = np.argsort(np.where(moving, ends.objective, np.inf)[rows], axis=1, kind="stable")
    place = order[:, : int(moving.sum(axis=1).max())]
    still = ~np.take_along_axis(moving[rows], place, axis=1)
    q = np.take_along_axis(ends.coordinates[rows], place[..., None], axis=1)
    part = problem if len(rows) == problem.size[0] else problem.take(rows)
    at = descend(part, q, precision, iterations, tolerance, still)
    w, k = np.broadcast_to(rows[:, None], place.shape)[~still], place[~still]
    ends.coordinates[w, k], ends.objective[w, k] = at.coordinates[~still], at.objective[~still]
    ends.evaluations[w, k] += at.evaluations[~still]
    ends.converged[w, k] = at.converged[~still]


def _as_low(objective: Array, asked: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which of the ends that are asked (W, K) are as low as the lowest of them."""
    judged = np.where(asked & np.isfinite(objective), objective, np.inf)
    level = np.maximum(judged.min(axis=1, keepdims=True) * (1.0 + AS_LOW), EXACT)
    return np.asarray(asked & (judged <= level))


def left_as_they_are(problem: Problem, ends: Array, evaluations: npt.NDArray[np.int64]) -> Polished:
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
    damping: float = FIRST_DAMPING,
) -> Polished:
    """Descend from starts (W, K, P) in one precision; those `left_out` (W, K) are not touched.

    The lanes of a vector take the starts of one wavelength, or wavelengths where each has a single one.

    Raises
    ------
    DeviceError
        The device does not have the precision, or cannot build or run the kernel.
    """
    import pyopencl as cl

    device, dtype = problem.device, precision.dtype
    seen = library_of(problem.seen)
    across = starts.shape[1] == 1
    library, part = ("coordinates", seen), "wavelengths" if across else "starts"
    variant = Variant.on(device, "polish", problem.model, precision, library, (part,), problem.free)
    kernel, queue = cl.Kernel(build(device, variant), "polish"), open_queue(device)
    (w, n), k, width = problem.size, starts.shape[1], variant.lanes.width
    data = [problem.target, problem.scale, problem.lower, problem.upper]
    if across:
        data = [_packed(values, width) for values in data]
        lanes = _packed(starts[:, 0], width)[:, None]
    else:
        places = np.arange(-(-k // width) * width)
        places = np.where(places < k, places, 0)
        lanes = starts[:, places].reshape(w, -1, width, starts.shape[2]).swapaxes(2, 3)
    # Lanes without a start of their own repeat the first, and stay where they are.
    still = np.ones((lanes.shape[0], lanes.shape[1] * width))
    given = np.zeros((w, k)) if left_out is None else left_out
    if across:
        still.reshape(-1)[:w] = given[:, 0]
    else:
        still[:, :k] = given

    def in_and_out(values: npt.NDArray[np.floating]) -> cl.Buffer:
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        return cl.Buffer(queue.context, flags, hostbuf=np.ascontiguousarray(values, dtype=dtype))

    q, ends = in_and_out(lanes), [in_and_out(values) for values in (0.0 * still, 0.0 * still, still)]
    sizes = np.uint32(len(problem.starts) - 1), np.uint32(n)
    # Held by name until the kernel has run: it does not hold them itself.
    observed, groups = upload_seen(device, problem.seen, dtype), upload(device, problem.starts)
    buffers = [upload(device, values, dtype) for values in data]
    kernel(
        *(queue, lanes.shape[1::-1], work_group(device, 2), *observed, groups, *sizes, *buffers),
        *(np.uint32(most_iterations), dtype(tolerance), dtype(damping), q, *ends),
    )
    host_q = np.empty(lanes.shape, dtype=dtype)
    host_ends = [np.empty(still.shape, dtype=dtype) for _ in range(3)]
    for host, buffer in zip((host_q, *host_ends), (q, *ends), strict=True):
        cl.enqueue_copy(queue, host, buffer)
    p = starts.shape[2]
    if across:
        objective, iterations, stopped = (a.reshape(-1, 1)[:w] for a in host_ends)
        ends_q = host_q.swapaxes(2, 3).reshape(-1, 1, p)[:w]
    else:
        objective, iterations, stopped = (a.reshape(w, -1)[:, :k] for a in host_ends)
        ends_q = host_q.swapaxes(2, 3).reshape(w, -1, p)[:, :k]
    return Polished(
        # The limits themselves may not be numbers of single precision.
        coordinates=np.clip(ends_q.astype(np.float64), problem.lower[:, None], problem.upper[:, None]),
        objective=objective.astype(np.float64),
        evaluations=iterations.astype(np.int64),
        converged=stopped > 0.0,
    )


def _packed(values: Array, width: int) -> Array:
    """Return rows (R, C) as lanes of vectors, (R / width, C, width); lanes to spare repeat the first row."""
    r, c = values.shape
    places = np.arange(-(-r // width) * width)
    return values[np.where(places < r, places, 0)].reshape(-1, width, c).swapaxes(1, 2)

"""From good starts to a stationary point: bounded Levenberg–Marquardt in fp64, batched in a kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.device import open_queue
from clbrdf.fit.problem import Problem
from clbrdf.precision import get_precision
from clbrdf.program import Variant, build, upload

Array = npt.NDArray[np.float64]

MOST_ITERATIONS = 300
TOLERANCE = 1e-14
"""Stop where a step would lower E by less than this, relative: below it rounding decides."""


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


def polish(problem: Problem, starts: Array) -> Polished:
    """Polish starts (W, K, P) at their wavelengths.

    Raises
    ------
    DeviceError
        The device has no fp64, or cannot build or run the kernel.
    """
    import pyopencl as cl

    device = problem.device
    variant = Variant.on(device, "polish", problem.model, get_precision("double"), ("coordinates",))
    kernel, queue = cl.Kernel(build(device, variant), "polish"), open_queue(device)
    (w, n), k, p = problem.size, starts.shape[1], starts.shape[2]
    groups, width = -(-k // variant.lanes.width), variant.lanes.width
    # Lanes without a start of their own repeat the first.
    places = np.where(np.arange(groups * width) < k, np.arange(groups * width), 0)
    lanes = starts[:, places].reshape(w, groups, width, p).transpose(0, 1, 3, 2)
    flags = cl.mem_flags.READ_WRITE
    q = cl.Buffer(queue.context, flags | cl.mem_flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(lanes))
    ends = [cl.Buffer(queue.context, flags, w * groups * width * 8) for _ in range(3)]
    rows, starts = upload(device, problem.features), upload(device, problem.starts)
    data = [upload(device, a) for a in (problem.target, problem.scale, problem.lower, problem.upper)]
    incident_groups = np.uint32(len(problem.starts) - 1)
    kernel(
        *(queue, (groups, w), None, rows, starts, incident_groups, np.uint32(n), *data),
        *(np.uint32(MOST_ITERATIONS), np.float64(TOLERANCE), q, *ends),
    )
    host_q = np.empty((w, groups, p, width))
    host_ends = [np.empty((w, groups * width)) for _ in range(3)]
    for host, buffer in zip((host_q, *host_ends), (q, *ends), strict=True):
        cl.enqueue_copy(queue, host, buffer)
    objective, iterations, done = (a[:, :k] for a in host_ends)
    return Polished(
        coordinates=host_q.transpose(0, 1, 3, 2).reshape(w, groups * width, p)[:, :k],
        objective=objective,
        evaluations=iterations.astype(np.int64),
        converged=done > 0.0,
    )

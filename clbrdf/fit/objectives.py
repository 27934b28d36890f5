"""The objective (13) of many parameter sets at many wavelengths, on the device."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem
from clbrdf.fit.seen import POINTS, library_of, upload_seen
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.lanes import Lanes, lanes_of
from clbrdf.opencl.precision import Precision
from clbrdf.opencl.program import Variant, build, upload, work_group

Array = npt.NDArray[np.float64]


def batch_objective(
    problem: Problem, parameters: Array, precision: Precision, lanes: Lanes | None = None
) -> Array:
    """Return E (W, K) of K parameter sets at each of W wavelengths.

    Parameters
    ----------
    problem : Problem
    parameters : (W, K, P) float64
        In the units of the model's table.
    precision : Precision
        Of the sums; exponents are single numbers also where model values would carry pairs.
    lanes : Lanes, optional
        Shape of the kernel; the device's own if not given.

    Raises
    ------
    DeviceError
        The device cannot build or run the kernel.
    """
    launch, read = prepare_objective(problem, parameters, precision, lanes)
    launch()
    return read()


def prepare_objective(
    problem: Problem, parameters: Array, precision: Precision, lanes: Lanes | None = None
) -> tuple[Callable[[], None], Callable[[], Array]]:
    """Build and upload; return one function that launches and waits, and one that reads E (W, K)."""
    import pyopencl as cl

    device, dtype = problem.device, precision.dtype
    shape = lanes or lanes_of(device, dtype)
    library = library_of(problem.seen)
    part = "points" if library == POINTS else "nodes"
    variant = Variant("objectives", problem.model, precision, shape, ("objective", library), (part,))
    kernel, queue = cl.Kernel(build(device, variant), "objectives"), open_queue(device)
    (w, n), (k, p) = problem.size, parameters.shape[1:]
    groups = -(-k // shape.width)
    places = np.arange(groups * shape.width) % k
    sets = parameters[:, places].reshape(w, groups, shape.width, p).transpose(0, 1, 3, 2)
    out = cl.Buffer(
        queue.context, cl.mem_flags.WRITE_ONLY, w * groups * shape.width * np.dtype(dtype).itemsize
    )
    arguments: list[Any] = [
        *(*upload_seen(device, problem.seen, dtype), upload(device, problem.starts)),
        *(np.uint32(len(problem.starts) - 1), np.uint32(n)),
        *(upload(device, values, dtype) for values in (problem.target, problem.scale, sets)),
        out,
    ]

    def launch() -> None:
        kernel(queue, (groups, w), work_group(device, 2), *arguments)
        queue.finish()

    def read() -> Array:
        host = np.empty((w, groups * shape.width), dtype=dtype)
        cl.enqueue_copy(queue, host, out)
        return host[:, :k].astype(np.float64)

    return launch, read

"""E for optimizers on an OpenCL device: a whole population a launch, data uploaded once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem
from clbrdf.fit.seen import POINTS, library_of, upload_seen
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import Variant, build, upload
from clbrdf.optimizers.objective import HUGE, NumpyObjective, tamed

Array = npt.NDArray[np.float64]


class DeviceObjective(NumpyObjective):
    """E and its gradient from OpenCL kernels; residuals, of which N travel for every E, from NumPy.

    Parameters
    ----------
    problem : Problem
        Its device runs the kernels.
    wavelength : int
    precision : str
        Of the kernels (clbrdf.opencl.precision), without pairs: "double" or "fast:…".

    Raises
    ------
    DeviceError
        The device cannot build the kernels.
    """

    def __init__(self, problem: Problem, wavelength: int = 0, precision: str = "double") -> None:
        import pyopencl as cl

        super().__init__(problem, wavelength)
        device, arithmetic = problem.device, get_precision(precision)
        self._given = problem.lower[wavelength]
        self._dtype: Any = arithmetic.dtype
        self._queue = open_queue(device)
        library = library_of(problem.seen)
        part = "points" if library == POINTS else "nodes"
        values = Variant.on(device, "objectives", problem.model, arithmetic, ("objective", library), (part,))
        gradients = Variant.on(device, "gradients", problem.model, arithmetic, ("coordinates", library))
        self._width = values.lanes.width
        self._values = cl.Kernel(build(device, values), "objectives")
        self._gradients = cl.Kernel(build(device, gradients), "gradients")
        seen, starts = upload_seen(device, problem.seen, self._dtype), upload(device, problem.starts)
        groups = np.uint32(len(problem.starts) - 1)
        target, scale = (
            upload(device, array[wavelength], self._dtype) for array in (problem.target, problem.scale)
        )
        self._values_data = (*seen, starts, groups, np.uint32(problem.size[1]), target, scale)
        self._gradients_data = (*seen, starts, groups, target, scale)
        self._room, self._buffers = 0, ()  # type: tuple[int, tuple[Any, ...]]

    def values(self, q: Array) -> Array:
        """E (K,) of coordinates (K, P)."""
        out = self._launch(self._values, self._values_data, self.coordinates.values(q), 1)
        return tamed(out[:, 0])

    def value_and_gradient(self, q: Array) -> tuple[float, Array]:
        """E and ∂E/∂q (P,); where E is HUGE, the gradient is 0."""
        whole = self.whole_coordinates(q)
        E, *slopes = self._launch(self._gradients, self._gradients_data, whole[None], 1 + len(whole))[0]
        gradient = np.array(slopes)[self.coordinates.free]
        if not (E < HUGE and np.isfinite(gradient).all()):
            return HUGE, np.zeros_like(q)
        return float(E), gradient

    def whole_coordinates(self, q: Array) -> Array:
        """All coordinates (P,) of the free ones (Q,)."""
        out: Array = self._given.copy()
        out[self.coordinates.free] = q
        return out

    def _launch(self, kernel: Any, data: tuple[Any, ...], sets: Array, results: int) -> Array:
        """Return (K, results) of sets (K, P), lanes that have no set of their own repeating the others."""
        import pyopencl as cl

        (k, p), width = sets.shape, self._width
        groups = -(-k // width)
        if groups > self._room:
            flags, item = cl.mem_flags, np.dtype(self._dtype).itemsize
            sizes = [(flags.READ_ONLY, p), (flags.WRITE_ONLY, 1 + p)]
            self._buffers = tuple(
                cl.Buffer(self._queue.context, flag, groups * width * rows * item) for flag, rows in sizes
            )
            self._room = groups
        places = np.arange(groups * width) % k
        with np.errstate(over="ignore"):  # what fp32 cannot hold becomes infinite, and E is HUGE there
            lanes = sets[places].reshape(groups, width, p).transpose(0, 2, 1).astype(self._dtype, order="C")
        cl.enqueue_copy(self._queue, self._buffers[0], lanes, is_blocking=False)
        kernel(self._queue, (groups, 1), None, *data, *self._buffers)
        host = np.empty((groups, results, width), dtype=self._dtype)
        cl.enqueue_copy(self._queue, host, self._buffers[1])
        return host.transpose(0, 2, 1).reshape(groups * width, results)[:k].astype(np.float64)

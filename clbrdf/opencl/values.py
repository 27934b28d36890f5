"""Model values in a named precision, block by block on the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.models import Model
from clbrdf.opencl.device import Device, open_queue
from clbrdf.opencl.precision import PRECISIONS, Precision
from clbrdf.opencl.program import Variant, build, upload

if TYPE_CHECKING:
    import pyopencl as cl

Array = npt.NDArray[np.float64]
Real = npt.NDArray[Any]
"""fp64 or fp32."""

BLOCK_VALUES = 1 << 24
"""Most values computed in one launch: 64 or 128 MiB on the device."""

FEATURE_PART = 1 << 14
"""Directions whose geometry is formed at once: a dozen such columns stay in the cache."""


def working_precision(model: Model, precision: Precision) -> Precision:
    """Return the arithmetic that keeps a precision's promise for a model: double where no pairs can."""
    return PRECISIONS["double"] if precision.careful and model.derived is None else precision


def evaluate_directions(
    model: Model, parameters: Array, directions: Directions, precision: Precision, device: Device
) -> Array:
    """Return f (N, W) of parameters (W, P) in N directions, block by block."""
    precision = working_precision(model, precision)
    n, w = len(directions), len(parameters)
    out = np.empty((n, w))
    block_n = max(1, min(n, BLOCK_VALUES))
    block_w = max(1, min(w, BLOCK_VALUES // block_n))
    for first in range(0, n, block_n):
        x = features_in_parts(model, directions[first : first + block_n], precision)
        for start in range(0, w, block_w):
            part = parameters[start : start + block_w]
            launcher = Launcher(model, part, precision, device)
            launcher.finish(launcher.begin(x), out[first : first + len(x), start : start + len(part)])
    return out


def features_in_parts(model: Model, directions: Directions, precision: Precision) -> Array:
    """Return the features (N, F), formed in parts that stay in the cache.

    In fp32 where the precision has no more digits to show; in fp64 else.
    """
    precision = working_precision(model, precision)
    dtype = np.float32 if precision.dtype is np.float32 and not precision.careful else np.float64
    out = np.empty((len(directions), len(model.feature_names)), dtype=dtype)
    for first in range(0, len(directions), FEATURE_PART):
        part = slice(first, first + FEATURE_PART)
        out[part] = model.features(directions[part], dtype)
    return out


@dataclass(frozen=True, eq=False)
class Pending:
    """A launch under way: `mapped` holds its result (W, N_padded) when `event` has come."""

    x: Real
    result: cl.Buffer
    mapped: Real
    event: cl.Event


class Launcher:
    """The evaluate kernel with parameters (W, P) on the device, ready for block after block of directions.

    A result stays in a buffer of the device until it is read, mapped where its memory is the host's and
    copied from a GPU; then the buffer serves again.
    """

    def __init__(self, model: Model, parameters: Array, precision: Precision, device: Device) -> None:
        import pyopencl as cl

        precision = working_precision(model, precision)
        self.model, self.parameters, self.precision, self.device = model, parameters, precision, device
        variant = Variant.on(device, "evaluate", model, precision, ("pair",) if precision.careful else ())
        self._width = variant.lanes.width
        self._kernel = cl.Kernel(build(device, variant), "evaluate")
        self._sets = upload_parameters(model, parameters, precision, device)
        self._spare: list[cl.Buffer] = []

    def begin(self, x: Array) -> Pending:
        """Begin to compute f in the directions of features (N, F); `finish` waits for it."""
        import pyopencl as cl

        queue = open_queue(self.device)
        rows = feature_rows(x[:, None, :], self._width)
        shape = (len(self.parameters), rows.shape[-1])
        size = int(np.dtype(self.precision.dtype).itemsize) * shape[0] * shape[1]
        result = self._spare.pop() if self._spare else None
        if result is None or result.size < size:
            result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, size)
        features = upload_features(rows, self.precision, self.device)
        padded = np.uint64(shape[1])
        self._kernel(queue, (shape[1] // self._width, shape[0]), None, features, padded, self._sets, result)
        if self.device.kind == "gpu":  # whose memory is its own
            mapped = np.empty(shape, self.precision.dtype)
            event = cl.enqueue_copy(queue, mapped, result, is_blocking=False)
        else:
            mapped, event = cl.enqueue_map_buffer(
                queue, result, cl.map_flags.READ, 0, shape, self.precision.dtype, is_blocking=False
            )
        queue.flush()
        return Pending(x, result, mapped, event)

    def finish(self, pending: Pending, out: Real) -> None:
        """Wait for a launch, write f into out (N, W), fp32 or fp64; NumPy gives what fp32 cannot hold."""
        pending.event.wait()
        out[...] = pending.mapped[:, : len(pending.x)].T
        mapping: Any = pending.mapped.base
        if mapping is not None:
            mapping.release(open_queue(self.device))
        self._spare.append(pending.result)
        if self.precision.dtype is np.float32 and not np.isfinite(out.max()):
            beyond = ~np.isfinite(out).all(axis=0)
            x = pending.x.astype(np.float64)
            out[:, beyond] = self.model.brdf(self.parameters[beyond][:, None, :], x).T


def mean_over(
    model: Model,
    parameters: Array,
    x: Array,
    weights: Array | None,
    shares: Array | None,
    precision: Precision,
    device: Device,
) -> Array:
    """Return weighted means (N, W) of model values, in one launch.

    Parameters
    ----------
    parameters : (W, B, P) float64
    x : (N, K, F) float64
        Features of K nodes for each of N results.
    weights : (N, K) float64 or None
        Of the nodes; None if there is one.
    shares : (B,) float64 or None
        Of the bands; None if there is one.
    """
    import pyopencl as cl

    precision = working_precision(model, precision)
    w, b, p = parameters.shape
    parts = ("nodes",) * (weights is not None) + ("bands",) * (shares is not None)
    library = ("pair",) if precision.careful else ()
    variant = Variant.on(device, "mean", model, precision, library, parts)
    kernel, queue = cl.Kernel(build(device, variant), "mean"), open_queue(device)
    rows = feature_rows(x, variant.lanes.width)
    features = upload_features(rows, precision, device)
    sets = upload_parameters(model, parameters.reshape(w * b, p), precision, device)
    padded = rows.shape[-1]
    arguments: list[object] = [features, np.uint64(padded)]
    if weights is not None:
        columns = np.zeros((weights.shape[1], padded))
        columns[:, : len(weights)] = weights.T
        arguments += [upload(device, columns, precision.dtype), np.uint64(len(columns))]
    if shares is not None:
        arguments += [upload(device, shares, precision.dtype), np.uint64(b)]
    host = np.empty((w, padded), dtype=precision.dtype)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes)
    # PoCL builds a kernel anew for each size of work group that it picks; the sizes differ from call to call.
    local = None if device.kind == "gpu" else (1, 1)
    kernel(queue, (w, padded // variant.lanes.width), local, *arguments, sets, result)
    cl.enqueue_copy(queue, host, result)
    out = host[:, : len(x)].T.astype(np.float64)
    if precision.dtype is np.float32 and device.has_double and not np.isfinite(out).all():
        return mean_over(model, parameters, x, weights, shares, PRECISIONS["double"], device)
    return out


def feature_rows(x: Array, width: int) -> Array:
    """Return features (N, K, F) as the kernels take them, (F, K, N_padded); at least one row of zeros."""
    n, k, f = x.shape
    rows = np.zeros((max(1, f), k, -(-n // width) * width), dtype=x.dtype)
    rows[:f, :, :n] = x.transpose(2, 1, 0)
    return rows


def upload_features(rows: Array, precision: Precision, device: Device) -> cl.Buffer:
    """Copy feature rows to a device, as pairs where the precision is careful."""
    if precision.careful:
        rows = np.concatenate(in_two(rows, precision.dtype), axis=0)
    return upload(device, rows, precision.dtype)


def upload_parameters(model: Model, parameters: Array, precision: Precision, device: Device) -> cl.Buffer:
    """Copy parameters (S, P) to a device, as pairs of derived ones where the precision is careful."""
    if precision.careful:
        assert model.derived is not None  # working_precision has seen to it
        parameters = np.concatenate(in_two(model.derived(parameters), precision.dtype), axis=1)
    return upload(device, parameters, precision.dtype)


def in_two(values: Array, dtype: type[np.floating]) -> tuple[Array, Array]:
    """Split values into what a type holds and what it leaves, both exact in that type to its precision."""
    high = values.astype(dtype).astype(np.float64)
    return high, values - high

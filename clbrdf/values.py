"""Model values in a named precision, block by block on the device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device, open_queue
from clbrdf.geometry import Directions
from clbrdf.models import Model
from clbrdf.precision import PRECISIONS, Precision
from clbrdf.program import Variant, build, upload

if TYPE_CHECKING:
    import pyopencl as cl

Array = npt.NDArray[np.float64]
Real = npt.NDArray[Any]
"""fp64 or fp32."""

BLOCK_VALUES = 1 << 24
"""Most values computed in one launch: 64 or 128 MiB on the device."""

FEATURE_PART = 1 << 14
"""Directions whose geometry is formed at once: a dozen such columns stay in the cache."""


def evaluate_directions(
    model: Model, parameters: Array, directions: Directions, precision: Precision, device: Device
) -> Array:
    """Return f (N, W) of parameters (W, P) in N directions, block by block."""
    n, w = len(directions), len(parameters)
    out = np.empty((n, w))
    block_n = max(1, min(n, BLOCK_VALUES))
    block_w = max(1, min(w, BLOCK_VALUES // block_n))
    for first in range(0, n, block_n):
        x = features_in_parts(model, directions[first : first + block_n], precision)
        for start in range(0, w, block_w):
            part = parameters[start : start + block_w]
            pending = enqueue(model, part, x, precision, device)
            block = out[first : first + len(x), start : start + len(part)]
            collect(pending, model, part, x, precision, block)
    return out


def features_in_parts(model: Model, directions: Directions, precision: Precision) -> Array:
    """Return the features (N, F), formed in parts that stay in the cache.

    In fp32 where the precision has no more digits to show; in fp64 else.
    """
    dtype = np.float32 if precision.dtype is np.float32 and not precision.careful else np.float64
    out = np.empty((len(directions), len(model.feature_names)), dtype=dtype)
    for first in range(0, len(directions), FEATURE_PART):
        part = slice(first, first + FEATURE_PART)
        out[part] = model.features(directions[part], dtype)
    return out


@dataclass(frozen=True, eq=False)
class Pending:
    """A launch under way: its result (W, N_padded) arrives in `host` when `event` has come."""

    host: Real
    event: cl.Event


def enqueue(model: Model, parameters: Array, x: Array, precision: Precision, device: Device) -> Pending:
    """Begin to compute f of parameters (W, P) and features (N, F); `collect` waits for it."""
    import pyopencl as cl

    variant = Variant.on(device, "evaluate", model, precision, ("pair",) if precision.careful else ())
    kernel, queue = cl.Kernel(build(device, variant), "evaluate"), open_queue(device)
    rows = feature_rows(x[:, None, :], variant.lanes.width)
    features, sets = upload_inputs(model, rows, parameters, precision, device)
    padded = rows.shape[-1]
    host = np.empty((len(parameters), padded), dtype=precision.dtype)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes)
    groups = padded // variant.lanes.width
    kernel(queue, (groups, len(host)), None, features, np.uint64(padded), sets, result)
    return Pending(host, cl.enqueue_copy(queue, host, result, is_blocking=False))


def collect(
    pending: Pending, model: Model, parameters: Array, x: Array, precision: Precision, out: Real
) -> None:
    """Wait for a launch and write f into out (N, W), fp32 or fp64; what fp32 cannot hold comes from NumPy."""
    pending.event.wait()
    values = pending.host[:, : len(x)]
    out[...] = values.T
    if precision.dtype is np.float32:
        beyond = ~np.isfinite(values).all(axis=1)
        if beyond.any():
            out[:, beyond] = model.brdf(parameters[beyond][:, None, :], x.astype(np.float64)).T


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

    w, b, p = parameters.shape
    parts = ("nodes",) * (weights is not None) + ("bands",) * (shares is not None)
    library = ("pair",) if precision.careful else ()
    variant = Variant.on(device, "mean", model, precision, library, parts)
    kernel, queue = cl.Kernel(build(device, variant), "mean"), open_queue(device)
    rows = feature_rows(x, variant.lanes.width)
    features, sets = upload_inputs(model, rows, parameters.reshape(w * b, p), precision, device)
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


def upload_inputs(
    model: Model, rows: Array, parameters: Array, precision: Precision, device: Device
) -> tuple[cl.Buffer, cl.Buffer]:
    """Copy feature rows and parameters (S, P) to a device, as pairs where the precision is careful."""
    columns = parameters
    if precision.careful:
        rows = np.concatenate(in_two(rows, precision.dtype), axis=0)
        columns = np.concatenate(in_two(model.derived(parameters), precision.dtype), axis=1)
    return upload(device, rows, precision.dtype), upload(device, columns, precision.dtype)


def in_two(values: Array, dtype: type[np.floating]) -> tuple[Array, Array]:
    """Split values into what a type holds and what it leaves, both exact in that type to its precision."""
    high = values.astype(dtype).astype(np.float64)
    return high, values - high

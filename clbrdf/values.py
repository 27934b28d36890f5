"""Model values in a named precision, block by block on the device."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device, open_queue
from clbrdf.geometry import Directions
from clbrdf.models import Model
from clbrdf.precision import Precision
from clbrdf.program import Variant, build, upload

Array = npt.NDArray[np.float64]

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
            _launch(model, part, x, precision, device, out[first : first + len(x), start : start + len(part)])
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


def _launch(
    model: Model, parameters: Array, x: Array, precision: Precision, device: Device, out: Array
) -> None:
    """Write f of parameters (W, P) and features (N, F) into out (N, W), in one launch."""
    import pyopencl as cl

    variant = Variant.on(device, "evaluate", model, precision, ("pair",) if precision.careful else ())
    kernel, queue = cl.Kernel(build(device, variant), "evaluate"), open_queue(device)
    groups = -(-len(x) // variant.lanes.width)
    padded = groups * variant.lanes.width
    rows, columns = np.zeros((x.shape[1], padded), dtype=x.dtype), parameters
    rows[:, : len(x)] = x.T
    if precision.careful:
        rows = np.concatenate(in_two(rows, precision.dtype), axis=0)
        columns = np.concatenate(in_two(model.derived(parameters), precision.dtype), axis=1)
    features = upload(device, rows, precision.dtype)
    sets = upload(device, columns, precision.dtype)
    host = np.empty((len(parameters), padded), dtype=precision.dtype)
    result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes)
    kernel(queue, (groups, len(host)), None, features, np.uint64(padded), sets, result)
    cl.enqueue_copy(queue, host, result)
    values = host[:, : len(x)]
    out[...] = values.T
    if precision.dtype is np.float32:
        beyond = ~np.isfinite(values).all(axis=1)
        if beyond.any():
            out[:, beyond] = model.brdf(parameters[beyond][:, None, :], x.astype(np.float64)).T


def in_two(values: Array, dtype: type[np.floating]) -> tuple[Array, Array]:
    """Split values into what a type holds and what it leaves, both exact in that type to its precision."""
    high = values.astype(dtype).astype(np.float64)
    return high, values - high

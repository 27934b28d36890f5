"""Model values on the device."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device, choose_device, open_queue
from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import DEFAULT_MODEL, Model, get_model
from clbrdf.program import DTYPES, Precision, Variant, build, upload

Array = npt.NDArray[np.float64]

BLOCK_VALUES = 1 << 24
"""Most values computed in one launch: 64 or 128 MiB on the device."""


def evaluate(
    parameters: Mapping[str, npt.ArrayLike],
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    phi: npt.ArrayLike,
    *,
    model: str = DEFAULT_MODEL,
    precision: Precision = "double",
    device: Device | None = None,
) -> Array:
    """Evaluate a model in N directions for one parameter set or for W of them.

    Parameters
    ----------
    parameters : mapping of str to float or (W,) array
        By name, in the units of the model's table; missing ones take the table's default.
    theta_i, theta_r, phi : float or (N,) array
        Degrees; zeniths in [0, 90), φ = φr − φi with 180 forward. Lengths broadcast.
    model : str
        Name of the model.
    precision : "single" or "double"
        Arithmetic of the work. Double: within 1e-12 relative of the equations wherever f > 1e-30.
    device : Device, optional
        From `choose_device`; the preferred one if not given.

    Returns
    -------
    (N,) or (N, W) float64
        BRDF in 1/sr, without the cosine.

    Raises
    ------
    InputError
        Unknown model, parameter or precision, angles out of range, lengths that do not agree.
    DeviceError
        No usable OpenCL device.
    """
    chosen = get_model(model)
    if precision not in DTYPES:
        raise InputError(f"no precision is called {precision!r}; there are {', '.join(DTYPES)}")
    vector = chosen.vector(parameters)
    directions = Directions(np.asarray(theta_i, float), np.asarray(theta_r, float), np.asarray(phi, float))
    values = evaluate_directions(
        chosen, np.atleast_2d(vector), directions, precision, device or choose_device()
    )
    return values[:, 0] if vector.ndim == 1 else values


def evaluate_directions(
    model: Model, parameters: Array, directions: Directions, precision: Precision, device: Device
) -> Array:
    """Return f (N, W) of parameters (W, P) in N directions, block by block."""
    import pyopencl as cl

    n, w = len(directions), len(parameters)
    out = np.empty((n, w))
    if out.size == 0:
        return out
    variant = Variant.on(device, "evaluate", model, precision)
    kernel = cl.Kernel(build(device, variant), "evaluate")
    queue, dtype = open_queue(device), DTYPES[precision]
    block_n = min(n, BLOCK_VALUES)
    block_w = max(1, min(w, BLOCK_VALUES // block_n))
    for first in range(0, n, block_n):
        x = model.features(directions[first : first + block_n])
        groups = -(-len(x) // variant.width)
        padded = groups * variant.width
        rows = np.zeros((x.shape[1], padded), dtype=dtype)
        rows[:, : len(x)] = x.T
        features = upload(device, rows)
        for start in range(0, w, block_w):
            part = upload(device, parameters[start : start + block_w], dtype)
            host = np.empty((min(block_w, w - start), padded), dtype=dtype)
            result = cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes)
            kernel(queue, (groups, len(host)), None, features, np.uint64(padded), part, result)
            cl.enqueue_copy(queue, host, result)
            out[first : first + len(x), start : start + len(host)] = host[:, : len(x)].T
    return out

"""Model values on the device."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device, choose_device, open_queue
from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import DEFAULT_MODEL, Model, get_model
from clbrdf.precision import Precision, get_precision
from clbrdf.program import Variant, build, upload

Array = npt.NDArray[np.float64]

BLOCK_VALUES = 1 << 24
"""Most values computed in one launch: 64 or 128 MiB on the device."""

REFERENCE = "reference"
REFERENCE_DIGITS = 60
"""Working digits of the reference: 1 − cosγ may lose 20 of them, and 40 are left."""


def evaluate(
    parameters: Mapping[str, npt.ArrayLike],
    theta_i: npt.ArrayLike,
    theta_r: npt.ArrayLike,
    phi: npt.ArrayLike,
    *,
    model: str = DEFAULT_MODEL,
    precision: str = "double",
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
    precision : str
        Arithmetic of the work: "fast" (or "fast:3" to "fast:5", the degree of its exp2), "single",
        "double", each with the bound stated in clbrdf.precision; or "reference", the published equations
        in 60 digits, rounded to float64, slow and without a device (needs mpmath).
    device : Device, optional
        From `choose_device`; the preferred one if not given.

    Returns
    -------
    (N,) or (N, W) float64
        BRDF in 1/sr, without the cosine. Values that leave the range of single precision are computed in
        double, so that none is infinite because of the arithmetic chosen.

    Raises
    ------
    InputError
        Unknown model, parameter or precision, angles out of range, lengths that do not agree.
    DeviceError
        No usable OpenCL device.
    """
    chosen = get_model(model)
    vector = chosen.vector(parameters)
    directions = Directions(np.asarray(theta_i, float), np.asarray(theta_r, float), np.asarray(phi, float))
    rows = np.atleast_2d(vector)
    if precision == REFERENCE:
        values = evaluate_reference(chosen, rows, directions)
    else:
        arithmetic = get_precision(precision)
        values = evaluate_directions(chosen, rows, directions, arithmetic, device or choose_device())
    return values[:, 0] if vector.ndim == 1 else values


def evaluate_directions(
    model: Model, parameters: Array, directions: Directions, precision: Precision, device: Device
) -> Array:
    """Return f (N, W) of parameters (W, P) in N directions, block by block."""
    n, w = len(directions), len(parameters)
    out = np.empty((n, w))
    block_n = max(1, min(n, BLOCK_VALUES))
    block_w = max(1, min(w, BLOCK_VALUES // block_n))
    for first in range(0, n, block_n):
        x = model.features(directions[first : first + block_n])
        for start in range(0, w, block_w):
            part = parameters[start : start + block_w]
            out[first : first + len(x), start : start + len(part)] = _launch(
                model, part, x, precision, device
            )
    return out


def _launch(model: Model, parameters: Array, x: Array, precision: Precision, device: Device) -> Array:
    """Return f (N, W) of parameters (W, P) and features (N, F) in one launch."""
    import pyopencl as cl

    variant = Variant.on(device, "evaluate", model, precision, ("pair",) if precision.careful else ())
    kernel, queue = cl.Kernel(build(device, variant), "evaluate"), open_queue(device)
    groups = -(-len(x) // variant.lanes.width)
    padded = groups * variant.lanes.width
    rows, columns = np.zeros((x.shape[1], padded)), parameters
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
    values: Array = host[:, : len(x)].T.astype(np.float64)
    if precision.dtype is np.float32:
        beyond = ~np.isfinite(values).all(axis=0)
        if beyond.any():
            values[:, beyond] = model.brdf(parameters[beyond][:, None, :], x).T
    return values


def in_two(values: Array, dtype: type[np.floating]) -> tuple[Array, Array]:
    """Split values into what a type holds and what it leaves, both exact in that type to its precision."""
    high = values.astype(dtype).astype(np.float64)
    return high, values - high


def evaluate_reference(model: Model, parameters: Array, directions: Directions) -> Array:
    """Return f (N, W) in 60 digits, rounded to float64.

    Raises
    ------
    InputError
        mpmath is not installed.
    """
    try:
        import mpmath
    except ImportError as error:
        raise InputError("precision 'reference' needs mpmath; install it with: pip install mpmath") from error
    angles = list(zip(directions.theta_i, directions.theta_r, directions.phi, strict=True))
    with mpmath.workdps(REFERENCE_DIGITS):
        return np.array([[float(model.reference(p, *a)) for p in parameters] for a in angles])

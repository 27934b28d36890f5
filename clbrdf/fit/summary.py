"""What a fit tells of itself at its parameters: sums over all directions, formed on the device.

`kernels/summary.cl` forms them in double precision, directions side by side in the lanes and in parts of
fixed length, so that neither the number of wavelengths nor of cores changes a digit. NumPy forms them where a
derivative is no number there, as at a parameter of 0 on a log scale, and where the detector sees more than
points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.blocks import BLOCK_BYTES, bytes_each
from clbrdf.fit.layout import Layout
from clbrdf.fit.problem import Problem, columns_of
from clbrdf.opencl.device import open_queue
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.program import Variant, build, upload, work_group
from clbrdf.opencl.values import feature_rows
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

PART = 4096
"""Directions of one work item."""

NUMPY_BLOCK = 1 << 16
"""Directions that NumPy takes at once."""


@dataclass(frozen=True, eq=False)
class Summary:
    """Sums over the directions at each of W wavelengths, s the scale of the problem.

    Attributes
    ----------
    objective : (W,) float64
        E of (13); NaN where no value counts.
    peak : (W,) float64
        Largest model value where a value counts, 1/sr; −∞ where none does.
    used : (W,) int64
        Values that count.
    gram : (W, P, P) float64
        Σ s² ∂f/∂p_i ∂f/∂p_j.
    spread : (W, P, P) float64
        Σ s⁴ σ² ∂f/∂p_i ∂f/∂p_j; NaN where σ is not known for all values that count.
    deviation, counted : (W, I) float64
        Σ ((f − m) / m)² by incident angle, over the values m > 0 that are not masked; how many those are.
    """

    objective: Array
    peak: Array
    used: npt.NDArray[np.int64]
    gram: Array
    spread: Array
    deviation: Array
    counted: Array

    def put(self, rows: npt.NDArray[np.intp], other: Summary) -> None:
        """Write what was summed at some wavelengths into this."""
        for field in fields(self):
            getattr(self, field.name)[rows] = getattr(other, field.name)


def empty_summary(wavelengths: int, parameters: int, angles: int) -> Summary:
    """Return a summary to be filled."""
    square = (wavelengths, parameters, parameters)
    return Summary(
        objective=np.empty(wavelengths),
        peak=np.empty(wavelengths),
        used=np.empty(wavelengths, dtype=np.int64),
        gram=np.empty(square),
        spread=np.empty(square),
        deviation=np.empty((wavelengths, angles)),
        counted=np.empty((wavelengths, angles)),
    )


def summarise_scan(
    scan: Scan,
    weights: Array,
    layout: Layout,
    problem_of: Callable[[npt.NDArray[np.intp]], Problem],
    places: npt.NDArray[np.intp],
    parameters: Array,
) -> Summary:
    """Return the sums of a scan at some of its wavelengths, block by block.

    Parameters
    ----------
    scan : Scan
    weights : (N, W) float64
    layout : Layout
    problem_of : callable
        Places of wavelengths -> their problem.
    places : (B,) int
        Of the wavelengths.
    parameters : (B, P) float64
    """
    _, angle = np.unique(scan.theta_i, return_inverse=True)
    angle = angle[layout.order]
    apart, random = _counts_apart(scan, weights), scan.random_sigma
    out = empty_summary(len(places), parameters.shape[1], int(angle.max()) + 1)
    size = max(1, BLOCK_BYTES // (2 * bytes_each(len(scan))))
    for first in range(0, len(places), size):
        rows = np.arange(first, min(first + size, len(places)))
        problem = problem_of(places[rows])
        noise, inverse = None, None
        if random is not None:
            (noise,) = columns_of((random,), layout.order, places[rows])
            noise *= problem.scale
            noise[problem.scale == 0.0] = 0.0
        if apart:
            assert scan.flags is not None
            measured, flags = columns_of((scan.brdf, scan.flags), layout.order, places[rows])
            usable = (flags == 0.0) & (measured > 0.0)
            inverse = np.divide(1.0, measured, out=np.zeros_like(measured), where=usable)
        out.put(rows, summarise(problem, parameters[rows], noise, inverse, angle))
    return out


def _counts_apart(scan: Scan, weights: Array) -> bool:
    """Whether values without weight count for the relative deviation."""
    assert scan.flags is not None
    for first in range(0, len(scan), NUMPY_BLOCK):
        part = slice(first, first + NUMPY_BLOCK)
        if ((weights[part] == 0.0) & (scan.flags[part] == 0) & (scan.brdf[part] > 0.0)).any():
            return True
    return False


def summarise(
    problem: Problem,
    parameters: Array,
    noise: Array | None,
    inverse: Array | None,
    angle: npt.NDArray[np.intp],
) -> Summary:
    """Return the sums at parameters (W, P).

    Parameters
    ----------
    problem : Problem
        N directions at W wavelengths.
    parameters : (W, P) float64
    noise : (W, N) float64 or None
        s σ; NaN where σ is unknown.
    inverse : (W, N) float64 or None
        1 / m of values that count for the deviation, 0 elsewhere; None where those are the positive values
        that count for E.
    angle : (N,) int
        Number of the incident angle.

    Raises
    ------
    DeviceError
        The device has no fp64, or cannot build or run the kernel.
    """
    used = np.count_nonzero(problem.scale, axis=1)
    known = np.zeros(len(used), dtype=np.bool_)
    if noise is not None:
        known = np.asarray(~(np.isnan(noise) & (problem.scale > 0.0)).any(axis=1))
    told = np.where(known[:, None], noise, 0.0) if noise is not None and known.any() else None
    if problem.seen.first is None:
        energy, peak, gram, spread, deviation = _on_device(problem, parameters, told, inverse)
        odd = np.flatnonzero(~np.isfinite(gram).all(axis=(1, 2)))
    else:
        w, p = parameters.shape
        energy, peak, deviation = np.empty(w), np.empty(w), np.empty(problem.size)
        gram, spread, odd = np.empty((w, p, p)), np.empty((w, p, p)), np.arange(w)
    for k in odd:
        at = parameters[k], None if told is None else told[k], None if inverse is None else inverse[k]
        energy[k], peak[k], gram[k], spread[k], deviation[k] = _in_numpy(problem, int(k), *at)
    spread[~known] = np.nan
    return Summary(
        objective=np.where(used > 0, energy, np.nan),
        peak=peak,
        used=used,
        gram=gram,
        spread=spread,
        deviation=_by_angle(deviation, angle),
        counted=_by_angle((problem.target if inverse is None else inverse) > 0.0, angle),
    )


def _on_device(
    problem: Problem, parameters: Array, noise: Array | None, inverse: Array | None
) -> tuple[Array, Array, Array, Array, Array]:
    """Return E (W,), peak (W,), G and S (W, P, P), squares of the relative deviation (W, N)."""
    import pyopencl as cl

    (w, n), p = problem.size, parameters.shape[1]
    device, precision = problem.device, get_precision("double")
    parts = ("noise",) * (noise is not None) + ("apart",) * (inverse is not None)
    variant = Variant.on(device, "summary", problem.model, precision, (), parts)
    kernel, queue = cl.Kernel(build(device, variant), "summary"), open_queue(device)
    width = variant.lanes.width
    vectors, part, pairs = -(-n // width), PART // width, p * (p + 1) // 2
    pieces, count = -(-vectors // part), 2 + pairs * (1 if noise is None else 2)

    def padded(values: Array) -> cl.Buffer:
        if n % width == 0:
            return upload(device, values)
        wide = np.zeros((w, vectors * width))
        wide[:, :n] = values
        return upload(device, wide)

    rows = feature_rows(problem.features[:, None, :], width)
    given = [padded(v) for v in (problem.target, problem.scale, noise, inverse) if v is not None]
    deviation, sums = np.empty((w, vectors * width)), np.empty((w, pieces, count, width))
    out = [cl.Buffer(queue.context, cl.mem_flags.WRITE_ONLY, host.nbytes) for host in (deviation, sums)]
    kernel(
        *(queue, (pieces, w), work_group(device, 2), upload(device, rows), np.uint64(vectors * width)),
        *(np.uint32(part), upload(device, parameters), *given, *out),
    )
    for host, buffer in zip((deviation, sums), out, strict=True):
        cl.enqueue_copy(queue, host, buffer)
    energy, peak, squares = np.zeros(w), np.full(w, -np.inf), np.zeros((w, count - 2))
    for piece in np.moveaxis(sums, 1, 0):  # one after the other: the order of a sum is part of its result
        for lane in range(width):
            energy += piece[:, 0, lane]
            peak = np.maximum(peak, piece[:, 1, lane])
            squares += piece[:, 2:, lane]
    i, j = np.tril_indices(p)
    square = np.full((2, w, p, p), np.nan)
    square[0, :, i, j] = square[0, :, j, i] = squares[:, :pairs].T
    if noise is not None:
        square[1, :, i, j] = square[1, :, j, i] = squares[:, pairs:].T
    return energy, peak, square[0], square[1], deviation[:, :n]


def _by_angle(values: npt.NDArray[Any], angle: npt.NDArray[np.intp]) -> Array:
    """Return sums (W, I) of (W, N) by the number of the incident angle (N,)."""
    begins = np.append(0, np.flatnonzero(np.diff(angle)) + 1)
    count = int(angle.max()) + 1
    if len(begins) > count:
        return np.stack([np.bincount(angle, row, count) for row in values])
    out = np.empty((len(values), count))  # the directions of each angle stand side by side
    out[:, angle[begins]] = np.add.reduceat(values, begins, axis=1, dtype=np.float64)
    return out


def _in_numpy(
    problem: Problem, k: int, parameters: Array, noise: Array | None, inverse: Array | None
) -> tuple[float, float, Array, Array, Array]:
    """As `_on_device`, at one wavelength, part by part of the directions."""
    p, n = len(parameters), problem.size[1]
    energy, peak, gram, spread = 0.0, -np.inf, np.zeros((p, p)), np.zeros((p, p))
    deviation = np.zeros(n)
    for first in range(0, n, NUMPY_BLOCK):
        places = np.arange(first, min(first + NUMPY_BLOCK, n))
        seen, s, y = problem.seen.take(places), problem.scale[k, places], problem.target[k, places]
        used = s > 0.0
        f = seen.brdf(parameters[None])
        residual = np.where(used, s * f - y, 0.0)
        energy += float((residual**2).sum())
        peak = max(peak, float(f.max(initial=-np.inf, where=used)))
        with np.errstate(divide="ignore", invalid="ignore"):
            away = np.where(y > 0.0, residual / y, 0.0)
        if inverse is not None:
            away = np.where(inverse[places] > 0.0, f * inverse[places] - 1.0, 0.0)
        deviation[places] = away**2
        jacobian = np.where(used[:, None], seen.jacobian(parameters[None]) * s[:, None], 0.0)
        gram += jacobian.T @ jacobian
        if noise is not None:
            jacobian *= noise[places, None]
            spread += jacobian.T @ jacobian
    return energy, peak, gram, spread, deviation

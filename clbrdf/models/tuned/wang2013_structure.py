"""What the equations of Wang, Zhang and Dong (2013) let a fit solve without searching.

For one incident direction the specular term (8) is an amplitude times a lobe that (c, d) and the geometry
alone decide,

    f_r = A(θi) · l(c, d) + k_d / π
    l   = exp[c v^d] G / (π cosθi cosθr)
    A   = k_s F = k_s exp[a (b − cosθi)²]

with v = 1 − cosγ. The lobes are the same at every wavelength, and ln A = a u² − 2ab u + (ab² + ln k_s) is a
quadratic in u = cosθi.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clbrdf.models.structure import Structure

Array = npt.NDArray[np.float64]

LOG2_E = 1.4426950408889634

NOTHING = -1e3
"""log2 of features below which they stand for 0."""

ORDERS = 14
"""Values of d in the grid: 0.14 apart over the table's limits."""

STEP = 0.5
"""Of log2 |c|: the lobe changes by at most 13 % of its top from one value to the next, for every d."""

FLAT, NARROW = 0.05, 40.0
"""|c| v^d of the widest lobe at the farthest direction and of the narrowest at the nearest: beyond, all
lobes are alike on these directions (constant, or nothing but the exact mirror direction)."""


def lobes(shapes: Array, x: Array) -> Array:
    """Lobes l of shapes (K, 2), c and d, in directions of features (N, 3): (K, N), 1/sr."""
    c, d = shapes[:, :1], shapes[:, 1:]
    values: Array = np.exp2(LOG2_E * c * np.exp2(d * x[:, 1]) + x[:, 2])
    return values


def shape_grid(x: Array, bounds: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """Shapes (K, 2), c and d, that cover what directions of features (N, 3) can tell apart.

    Returns them with their places (K, 2) in a grid of d and log2 |c|. `bounds` (2, 2) are limits of c and d.
    """
    seen = x[(x[:, 1] > NOTHING) & (x[:, 2] > NOTHING), 1]
    low, high = np.log2(np.maximum(-bounds[0][::-1], 1e-9))
    d = np.linspace(bounds[1, 0], bounds[1, 1], ORDERS)
    nearest, farthest = (seen.min(), seen.max()) if len(seen) else (-1.0, -1.0)
    first = np.clip(np.log2(FLAT) - d * farthest, low, high)
    last = np.clip(np.log2(NARROW) - d * nearest, first, high)
    steps = np.arange(low, high + STEP, STEP)
    log2_c = np.clip(steps, first[:, None], last[:, None])
    values = np.stack([-np.exp2(log2_c), np.broadcast_to(d[:, None], log2_c.shape)], axis=-1)
    places = np.moveaxis(np.indices(log2_c.shape), 0, -1)
    different = np.diff(log2_c, axis=1, prepend=np.nan) != 0.0
    return values[different], places[different]


def log_growth(growth: Array, x: Array) -> Array:
    """ln F (12) of growths (..., 2), a and b, at incident features (I, 1): (..., I)."""
    a, b = growth[..., 0, None], growth[..., 1, None]
    out: Array = a * (b - x[:, 0]) ** 2
    return out


def growths(log_amplitude: Array, weight: Array, x: Array, bounds: Array) -> Array:
    """Growths (a, b) that pass through amplitudes as well as the limits (2, 2) of a and b allow.

    Weighted straight-line and quadratic fits of ln A (..., I) over u = cosθi, the incident features (I, 1):
    free, without growth, and with a or b at a limit. Returns (..., V, 2) within the limits.
    """
    u = x[:, 0]
    (a_low, a_high), (b_low, b_high) = bounds
    total = weight.sum(axis=-1, keepdims=True)
    w = weight / np.where(total > 0.0, total, 1.0)
    powers = np.stack([np.ones_like(u), u, u**2], axis=-1)
    # The small ridge decides where fewer than three incident angles leave a choice.
    system = np.einsum("...i,ij,ik->...jk", w, powers, powers) + 1e-13 * np.eye(3)
    right = np.einsum("...i,ij->...j", w * log_amplitude, powers)
    quadratic = np.linalg.solve(system, right[..., None])[..., 0]
    a = quadratic[..., 2]
    a = np.where(np.abs(a) < 1e-6, 1e-6, a)
    pairs = [(a, -quadratic[..., 1] / (2.0 * a)), (np.zeros_like(a), np.full_like(a, 0.5))]
    pairs += [(_slope((edge - u) ** 2, log_amplitude, w), np.full_like(a, edge)) for edge in (b_low, b_high)]
    for edge in (a_low, a_high):
        if edge != 0.0:
            b = -_slope(u, log_amplitude - edge * u**2, w) / (2.0 * edge)
            pairs.append((np.full_like(a, edge), b))
    out = np.stack([np.stack(pair, axis=-1) for pair in pairs], axis=-2)
    within: Array = np.clip(out, bounds[:, 0], bounds[:, 1])
    return within


def growth_grid(bounds: Array) -> Array:
    """Growths (G, 2), a and b, over limits (2, 2): a denser towards 0, where a little matters."""
    a = np.sinh(np.linspace(np.arcsinh(bounds[0, 0]), np.arcsinh(bounds[0, 1]), 15))
    b = np.linspace(bounds[1, 0], bounds[1, 1], 13)
    return np.stack(np.meshgrid(a, b, indexing="ij"), axis=-1).reshape(-1, 2)


def _slope(z: Array, y: Array, w: Array) -> Array:
    """Slope of the weighted straight line of y (..., I) over z (I,); weights add up to 1 or 0."""
    away = z - (w * z).sum(axis=-1, keepdims=True)
    spread = (w * away**2).sum(axis=-1)
    enough = spread > 1e-12
    return np.where(enough, (w * away * y).sum(axis=-1) / np.where(enough, spread, 1.0), 0.0)


STRUCTURE = Structure(
    shape=("c", "d"),
    growth=("a", "b"),
    linear=("ks", "kd"),
    diffuse=1.0 / np.pi,
    lobes=lobes,
    shape_grid=shape_grid,
    log_growth=log_growth,
    growths=growths,
    growth_grid=growth_grid,
)

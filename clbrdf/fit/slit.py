"""A slit ties neighbouring wavelengths: what is measured at one is a mean over the band that the slit passes.

    f_seen(λ_w) = ∫ s(δ) f(λ_w + δ) dδ ≈ Σ_v S_wv f(λ_v)

f between the measured wavelengths is the cubic through the four nearest. Residuals at one wavelength so
depend on the parameters at its neighbours, and the normal equations of all wavelengths are banded: fits
that are smooth in wavelength solve such a system anyway (`clbrdf.fit.smooth`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.problem import Problem

if TYPE_CHECKING:
    from clbrdf.instrument.bandwidth import Bandwidth

Array = npt.NDArray[np.float64]

ORDER = 16
"""Nodes on half a slit."""

NEGLIGIBLE = 1e-9
"""Entries of the slit's matrix below this are left out."""


def slit_matrix(settings: Bandwidth, wavelength: Array) -> Array:
    """Return S (W, W); its rows add up to 1.

    Raises
    ------
    InputError
        The band is narrower than the distance of the wavelengths, between which nothing is known.
    """
    from clbrdf.instrument.bandwidth import slit_nodes

    w = len(wavelength)
    apart = float(np.diff(wavelength).max()) if w > 1 else np.inf
    if settings.width < apart:
        raise InputError(
            f"bandwidth of {settings.width:g} nm is finer than the scan's wavelengths, which are"
            f" {apart:g} nm apart; leave it out"
        )
    offsets, shares = slit_nodes(settings, ORDER)
    points = min(4, w)
    at = wavelength[:, None] + offsets
    first = np.clip(np.searchsorted(wavelength, at) - points // 2, 0, w - points)
    places = first[..., None] + np.arange(points)
    known = wavelength[places]
    out = np.zeros((w, w))
    for k in range(points):
        others = np.delete(np.arange(points), k)
        lagrange = ((at[..., None] - known[..., others]) / (known[..., [k]] - known[..., others])).prod(
            axis=-1
        )
        np.add.at(out, (np.arange(w)[:, None], places[..., k]), shares * lagrange)
    out[np.abs(out) < NEGLIGIBLE] = 0.0
    return out


@dataclass(frozen=True, eq=False)
class SlitEquations:
    """Normal equations of all wavelengths behind a slit, at some coordinates.

    Attributes
    ----------
    energy : (W,) float64
        E.
    gradient : (W, P) float64
        Half the gradient of Σ E_w / v_w.
    blocks : list of (W − d, P, P) float64
        Of its JᵀJ, d blocks beside the diagonal, d = 0, 1, …
    """

    energy: Array
    gradient: Array
    blocks: list[Array]


def slit_equations(problem: Problem, slit: Array, noise: Array, q: Array) -> SlitEquations:
    """Return the normal equations at coordinates (W, P); `noise` (W,) are the v_w."""
    model = problem.model
    parameters = model.from_coordinates(q)
    slopes = np.stack([row.slope(parameters[:, j]) for j, row in enumerate(model.parameters)], axis=1)
    s = problem.scale
    seen = slit @ problem.seen.brdf(parameters[:, None, :])
    residual = np.where(s > 0.0, s * seen, 0.0) - problem.target
    jacobian = problem.seen.jacobian(parameters[:, None, :]) * slopes[:, None, :]
    pull = slit.T @ (s * residual / noise[:, None])
    weight = s**2 / noise[:, None]
    reach = reach_of(slit)
    blocks = []
    for d in range(min(2 * reach, len(q) - 1) + 1):
        # Of all rows that hold both v and v + d.
        rows = len(q) - d
        both = np.einsum("wv,wv,wn->vn", slit[:, :rows], slit[:, d:], weight, optimize=True)
        blocks.append(np.einsum("vnp,vn,vnr->vpr", jacobian[:rows], both, jacobian[d:], optimize=True))
    return SlitEquations(
        energy=(residual**2).sum(axis=1),
        gradient=np.einsum("vnp,vn->vp", jacobian, pull),
        blocks=blocks,
    )


def reach_of(slit: Array) -> int:
    """How many wavelengths to either side a slit mixes in."""
    rows, columns = np.nonzero(slit)
    return int(np.abs(rows - columns).max())


def banded(blocks: list[Array], stiffness: Array, held: npt.NDArray[np.bool_]) -> Array:
    """Lower band of the system with the penalty's ties, as SciPy stores it; held coordinates stand alone."""
    w, p = held.shape
    zero, free = np.zeros((1, p)), ~held
    ties = np.concatenate([zero, stiffness]) + np.concatenate([stiffness, zero])
    band = np.zeros((len(blocks) * p if len(blocks) > 1 else 2 * p, w * p))
    for d in range(max(2, len(blocks)) if w > 1 else 1):
        block = blocks[d].copy() if d < len(blocks) else np.zeros((w - d, p, p))
        if d == 0:
            block += ties[:, :, None] * np.eye(p)
        elif d == 1:
            block -= stiffness[:, :, None] * np.eye(p)
        block *= free[: w - d, :, None] & free[d:, None, :]
        if d == 0:
            block += np.eye(p) * held[:, :, None]
        for i in range(p):
            for j in range(p):
                # Row (v + d, j) and column (v, i) of the lower triangle.
                below = d * p + j - i
                if below >= 0:
                    band[below, i : (w - d) * p : p] = block[:, i, j]
    return band


def band_covariance(band: Array, p: int) -> Array:
    """Diagonal blocks (W, P, P) of the inverse of a banded system."""
    from scipy.linalg import cho_solve_banded, cholesky_banded

    size = band.shape[1]
    band = band.copy()
    band[0] *= 1.0 + 1e-12
    factor = cholesky_banded(band, lower=True)
    out = np.empty((size // p, p, p))
    columns = max(p, (1 << 20) // size // p * p)
    for first in range(0, size, columns):
        last = min(first + columns, size)
        right = np.zeros((size, last - first))
        right[np.arange(first, last), np.arange(last - first)] = 1.0
        solved = cho_solve_banded((factor, True), right)
        for v in range(first // p, last // p):
            out[v] = solved[v * p : (v + 1) * p, v * p - first : (v + 1) * p - first]
    return out

"""E (13) from a few sums: linear parameters solved in closed form, lobe by lobe.

With a lobe l, an amplitude A_i for each group i of incident directions and a diffuse term r,

    E = Σ_i [A_i² (l·l)_i + 2 A_i r (l·1)_i − 2 A_i (l·m)_i] + r² (1·1) − 2 r (1·m) + (m·m),

where (f·g)_i sums s² f g over the directions of group i, with the scale s of the problem.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.box import box_minimum

Array = npt.NDArray[np.float64]


TILE = 1 << 18
"""Multiplications of one tile of a product; eight rows side by side are what such a library works on."""

CACHED = 1 << 15
"""Values of one array that are worked on at once."""

LOBES = 64
"""Columns of a tile."""


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums over directions at W wavelengths, for K lobes and I groups of incident directions.

    Formed with each wavelength's scale divided by its largest value: E comes in units of that value squared.
    The first three have 1 in place of W where all wavelengths then share one scale.

    Attributes
    ----------
    one_one : (I, W) float64
    lobe_lobe, lobe_one : (I, W, K) float64
    lobe_data : (I, W, K) float64
    one_data : (I, W) float64
    data_data : (W,) float64
    """

    one_one: Array
    lobe_lobe: Array
    lobe_one: Array
    lobe_data: Array
    one_data: Array
    data_data: Array

    @classmethod
    def project(cls, target: Array, scale: Array, lobes: Array, group: npt.NDArray[np.intp]) -> Sums:
        """Project data s m (W, N) with scale s (W, N) on lobes (K, N), directions in groups (N,)."""
        largest = scale.max(axis=1, keepdims=True)
        unit, data = scale / largest, target / largest
        measured = data * unit
        if np.allclose(unit, unit[0], rtol=1e-12, atol=0.0):
            unit = unit[:1]
        squares = unit**2
        groups = [np.flatnonzero(group == i) for i in range(group.max() + 1)]
        parts = [np.ascontiguousarray(lobes[:, places].T) for places in groups]
        pairs = list(zip(groups, parts, strict=True))
        return cls(
            one_one=np.stack([squares[:, places].sum(axis=1) for places in groups]),
            lobe_lobe=np.stack([product(squares[:, places], part**2) for places, part in pairs]),
            lobe_one=np.stack([product(squares[:, places], part) for places, part in pairs]),
            lobe_data=np.stack([product(measured[:, places], part) for places, part in pairs]),
            one_data=np.stack([measured[:, places].sum(axis=1) for places in groups]),
            data_data=(data**2).sum(axis=1),
        )

    def rows(self, part: slice) -> Sums:
        """Return the sums at some wavelengths."""
        scale = part if len(self.lobe_one[0]) == len(self.lobe_data[0]) else slice(None)
        return Sums(
            one_one=self.one_one[:, scale],
            lobe_lobe=self.lobe_lobe[:, scale],
            lobe_one=self.lobe_one[:, scale],
            lobe_data=self.lobe_data[:, part],
            one_data=self.one_data[:, part],
            data_data=self.data_data[part],
        )

    def take(self, chosen: npt.NDArray[np.intp]) -> Sums:
        """Return the sums of some lobes (W, M) of each wavelength."""
        return replace(
            self,
            lobe_lobe=np.take_along_axis(self.lobe_lobe, chosen[None], axis=2),
            lobe_one=np.take_along_axis(self.lobe_one, chosen[None], axis=2),
            lobe_data=np.take_along_axis(self.lobe_data, chosen[None], axis=2),
        )


def product(left: Array, right: Array) -> Array:
    """Return left (W, N) times right (N, K), in tiles of one size, whatever W is.

    Each row then is summed in the same order, and no tile is large enough for a library of linear algebra to
    spread it over threads of its own, which would wait for each other beside ours.
    """
    (w, n), k = left.shape, right.shape[1]
    rows = 8 * max(1, TILE // (8 * LOBES * n))
    tall, wide = -(-w // rows), -(-k // LOBES)
    a = np.zeros((tall * rows, n))
    a[:w] = left
    b = np.zeros((n, wide * LOBES))
    b[:, :k] = right
    tiles = a.reshape(tall, 1, rows, n) @ b.reshape(n, wide, LOBES).transpose(1, 0, 2).copy()[None]
    out: Array = tiles.transpose(0, 2, 1, 3).reshape(tall * rows, wide * LOBES)[:w, :k]
    return out


def best_amplitudes(sums: Sums) -> tuple[Array, Array]:
    """E (W, K) and amplitudes (I, W, K) of the best amplitudes and diffuse term, none negative.

    A few wavelengths at a time, so that what is formed of them stays in the cache.
    """
    i, w, k = sums.lobe_data.shape
    size = max(1, CACHED // (i * k))
    parts = [_best_amplitudes(sums.rows(slice(first, first + size))) for first in range(0, w, size)]
    energy, amplitudes = zip(*parts, strict=True)
    return np.concatenate(energy), np.concatenate(amplitudes, axis=1)


def _best_amplitudes(sums: Sums) -> tuple[Array, Array]:
    """As `best_amplitudes`.

    The normal equations are an arrow: amplitudes meet only in the diffuse term, which is solved first.
    Amplitudes that come out negative are set to 0 and the rest solved once more.
    """
    felt = sums.lobe_lobe > 1e-300
    inverse = np.where(felt, 1.0 / np.where(felt, sums.lobe_lobe, 1.0), 0.0)
    ones, data = sums.one_one.sum(axis=0)[:, None], sums.one_data.sum(axis=0)[:, None]
    taken_one, taken_data = sums.lobe_one**2 * inverse, sums.lobe_one * sums.lobe_data * inverse
    share, per_rest = sums.lobe_data * inverse, sums.lobe_one * inverse
    positive: Array | float = 1.0
    for _ in range(2):
        left = ones - (taken_one * positive).sum(axis=0)
        right = data - (taken_data * positive).sum(axis=0)
        solvable = left > 1e-12 * ones
        rest = np.maximum(np.where(solvable, right / np.where(solvable, left, 1.0), 0.0), 0.0)
        amplitudes = (share - rest * per_rest) * positive
        positive = (amplitudes > 0.0).astype(np.float64)
    amplitudes *= positive
    lobe = amplitudes * (amplitudes * sums.lobe_lobe + 2.0 * (rest * sums.lobe_one - sums.lobe_data))
    energy = lobe.sum(axis=0) + rest * (rest * ones - 2.0 * data) + sums.data_data[:, None]
    return energy, amplitudes


def best_linear(sums: Sums, growth: Array, most: Array, most_rest: float) -> tuple[Array, Array, Array]:
    """E, weight of the lobe and diffuse term, each (W, M, V), the best within [0, most] and [0, most_rest].

    `growth` (I, W, M, V) multiplies the weight into amplitudes.
    """
    x = np.einsum("iwmv,iwm->wmv", growth**2, sums.lobe_lobe)
    z = np.einsum("iwmv,iwm->wmv", growth, sums.lobe_one)
    r = np.einsum("iwmv,iwm->wmv", growth, sums.lobe_data)
    s, t, e = (
        a[:, None, None] for a in (sums.one_one.sum(axis=0), sums.one_data.sum(axis=0), sums.data_data)
    )
    # In units in which lobe and diffuse term have length 1; what is not felt stays at 0.
    felt = x > 1e-300
    length, rest_length = np.sqrt(np.where(felt, x, 1.0)), np.sqrt(s)
    across = np.where(felt, z / (length * rest_length), 0.0)
    one = np.ones_like(across)
    R = np.array([[one, across], [across, one]])
    b = np.stack(np.broadcast_arrays(np.where(felt, -r / length, 0.0), -t / rest_length))
    with np.errstate(over="ignore"):
        high = np.stack(np.broadcast_arrays(most * length, most_rest * rest_length))
    (weight, rest), energy = box_minimum(R, b, np.zeros_like(high), high)
    return e + energy, weight / length, rest / rest_length

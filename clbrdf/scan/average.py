"""Repeats of a direction as one: weighted means of values that are not masked."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")


def spread_of_repeats(scan: Any, numbers: npt.NDArray[np.intp]) -> float:
    """Return by how much values of one direction and wavelength differ at most; NaN without repeats.

    That is (largest − smallest) / largest, of values above 0 that are not masked. `numbers` (N,) says to
    which direction each row belongs.
    """
    rows = np.flatnonzero((np.bincount(numbers) > 1)[numbers])
    if not len(rows):
        return float("nan")
    _, group = np.unique(numbers[rows], return_inverse=True)
    value, good = scan.brdf[rows], ~scan.mask[rows] & (scan.brdf[rows] > 0.0)
    shape = int(group.max()) + 1, value.shape[1]
    low, high, count = np.full(shape, np.inf), np.zeros(shape), np.zeros(shape, dtype=np.intp)
    np.minimum.at(low, group, np.where(good, value, np.inf))
    np.maximum.at(high, group, np.where(good, value, 0.0))
    np.add.at(count, group, good)
    several = count > 1
    return float(np.max(1.0 - low[several] / high[several])) if several.any() else float("nan")


def averaged(scan: Any, numbers: npt.NDArray[np.intp]) -> dict[str, Any]:
    """Return the fields of a scan (`record.Scan`, which stands above) that change when repeats are averaged.

    `numbers` (N,) says to which direction each row belongs. Directions keep the order of their first rows.
    """
    _, first, numbers = np.unique(numbers, return_index=True, return_inverse=True)
    order = np.argsort(first)
    numbers, first = np.argsort(order)[numbers.ravel()], first[order]
    size, w = len(first), scan.brdf.shape[1]

    def total(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        out = np.zeros((size, *values.shape[1:]))
        np.add.at(out, numbers, values)
        return out

    good = ~scan.mask
    sigma = scan.sigma
    weight = good.astype(np.float64)
    if sigma is not None:
        known = good & np.greater(sigma, 0.0)
        all_known = (total(good & ~known) == 0.0)[numbers]
        weight = np.where(all_known & known, np.where(known, sigma, 1.0) ** -2.0, weight)
    sums = total(weight)
    told = sums > 0.0
    mean = total(weight * np.where(good, scan.brdf, 0.0)) / np.where(told, sums, 1.0)
    flags = np.where(told, 0, scan.flags[first]).astype(np.uint32)
    out: dict[str, Any] = {name: getattr(scan, name)[first] for name in ANGLES}
    out |= {"brdf": np.where(told, mean, scan.brdf[first]), "flags": flags}
    if sigma is not None:
        square = total((weight * np.where(good, sigma, 0.0)) ** 2)
        out["sigma"] = np.where(told, np.sqrt(square) / np.where(told, sums, 1.0), sigma[first])
    if scan.solid_angle is not None:
        out["solid_angle"] = total(scan.solid_angle) / np.bincount(numbers, minlength=size)
    assert out["brdf"].shape == (size, w)
    return out

"""What a fit is asked for, looked at before it begins."""

from __future__ import annotations

from operator import index
from typing import SupportsIndex

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.scan import Scan

PLAUSIBLE = (1e-15, 1e15)
"""BRDF that a fit takes, 1/sr: within, single precision holds all that the chains form of it."""

PART = 1 << 14
"""Directions that are looked at at once."""


def whole_seed(seed: SupportsIndex) -> int:
    """Return a seed as an int, also one of NumPy; raise InputError where it is none, or too large."""
    try:
        whole = index(seed)
    except TypeError:
        whole = -1
    if not 0 <= whole < 2**64:
        raise InputError(f"seed is {seed}; give a whole number from 0 to 2^64 - 1")
    return whole


def reflection_of(scan: Scan, weights: str | npt.ArrayLike) -> tuple[Scan, str | npt.ArrayLike, int]:
    """Return scan and weights without directions of transmission, and how many there were."""
    beyond = scan.transmitted
    if not beyond.any():
        return scan, weights, 0
    per_direction = np.asarray(weights)
    if not isinstance(weights, str) and per_direction.shape == beyond.shape:
        weights = per_direction[~beyond]
    return scan.reflection(), weights, int(np.count_nonzero(beyond))


def check_number(name: str, value: float | None, low: float, high: float) -> None:
    """Raise InputError where an option is given and is no number within its limits."""
    if value is not None and not (isinstance(value, (int, float)) and low <= value <= high):
        said = advice(name, f"--{name.replace('_', '-')}")
        raise InputError(f"{said} is {value}; give {low:g} to {high:g}")


def check_together(
    weights: object,
    shared: bool,
    *,
    smooth: float | None,
    rtol: float | None,
    monte_carlo: int | None,
    gls: bool,
    profile: bool,
) -> None:
    """Raise InputError where options of a fit are given that do not go together."""
    if shared and smooth is not None:
        both = advice("shared and smooth", "--shared and --smooth")
        raise InputError(f"{both} both tie wavelengths; give one of them")
    if shared and rtol is not None:
        said, other = advice("rtol", "--rtol"), advice("shared", "--shared")
        raise InputError(f"{said} chooses a search for each wavelength by itself; leave it out, or {other}")
    if monte_carlo is not None and (shared or smooth is not None):
        said = advice("monte_carlo", "--monte-carlo")
        both = advice("shared and smooth", "--shared and --smooth")
        raise InputError(f"{said} fits every wavelength by itself; leave it out, or leave out {both}")
    if gls and (shared or smooth is not None or monte_carlo is not None):
        raise InputError(
            f"{advice('gls', '--gls')} fits every wavelength by itself; leave it out, or leave out"
            f" {advice('shared, smooth and monte_carlo', '--shared, --smooth and --monte-carlo')}"
        )
    if gls and not (isinstance(weights, str) and weights == "sigma"):
        mend = advice("weights='sigma'", "--weights sigma")
        raise InputError(f"{advice('gls', '--gls')} weighs by the uncertainties; give {mend}, too")
    if profile and (shared or smooth is not None or rtol is not None):
        said = advice("profile", "--profile")
        others = advice("shared, smooth, rtol", "--shared, --smooth, --rtol")
        raise InputError(f"{said} asks each wavelength at its optimum; leave it out, or {others}")


def check_range(scan: Scan, weights: npt.NDArray[np.float64]) -> None:
    """Raise InputError where values to be fitted lie beyond all surfaces: their unit is another."""
    low, high = PLAUSIBLE
    smallest, largest = np.inf, 0.0
    for first in range(0, len(scan), PART):
        part = slice(first, first + PART)
        used = np.abs(scan.brdf[part])
        counts = (weights[part] > 0.0) & (used > 0.0)
        smallest = used.min(initial=smallest, where=counts)
        largest = used.max(initial=largest, where=counts)
    if smallest < low or largest > high:
        worst = largest if largest > high else smallest
        raise InputError(
            f"BRDF of {worst:g} 1/sr; fits take {low:g} to {high:g} 1/sr: check the unit of the data"
        )

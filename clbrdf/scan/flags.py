"""Why a value is masked: named bits, and those that a value earns by itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Array = npt.NDArray[np.float64]
Bits = npt.NDArray[np.uint32]

FLAGS = ("not_measured", "not_a_number", "infinite", "zero", "negative")
"""Reasons every scan knows, bits 0 to 4; a scan's own reasons take the bits after them."""

MOST_FLAGS = 32

ALLOWED_SIGMAS = 5.0
"""A value at or below zero is noise about a small one where it lies within so many standard uncertainties.

Of normal noise about zero 3 values in 10 million lie beyond, too few to bias what is fitted to the rest.
"""


def flag_unusable(brdf: Array, flags: Bits, sigma: Array | None = None) -> Bits:
    """Return the flags with the bits for NaN, infinite, zero and negative values set.

    Zero and negative values are data, and not flagged, where a standard uncertainty allows them: where
    f ≥ −5σ and σ > 0; older programs flagged them all, so that their two bits are set anew. A NaN that is
    flagged as not measured is no surprise and gets no second reason.

    Parameters
    ----------
    brdf : (N, W) float64
        1/sr.
    flags : (N, W) uint32
    sigma : (N, W) float64 or None
        1/sr, NaN where unknown.
    """
    out = flags.copy()
    finite = np.isfinite(brdf)
    if not finite.all():
        missing = (out & _bit("not_measured")) != 0
        out[np.isnan(brdf) & ~missing] |= _bit("not_a_number")
        out[np.isinf(brdf)] |= _bit("infinite")
    low = finite & (brdf <= 0.0)
    if low.any():
        out[low] &= ~(_bit("zero") | _bit("negative"))
        if sigma is not None:
            # A comparison with NaN is false: an unknown uncertainty allows nothing.
            low &= ~((sigma > 0.0) & (brdf >= -ALLOWED_SIGMAS * sigma))
        out[low & (brdf == 0.0)] |= _bit("zero")
        out[low & (brdf < 0.0)] |= _bit("negative")
    return out


def for_other_reasons(flags: Bits) -> npt.NDArray[np.bool_]:
    """Return where a value is flagged for another reason than being zero or negative, (N, W)."""
    return np.asarray(flags & ~(_bit("zero") | _bit("negative")), dtype=np.bool_)


def check_flag_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return flag names as a tuple.

    Raises
    ------
    InputError
        Names that do not begin with FLAGS, repeat, or are more than 32.
    """
    found = tuple(names)
    if found[: len(FLAGS)] != FLAGS or len(found) > MOST_FLAGS or len(set(found)) < len(found):
        raise InputError(f"flag names are {found}; they start with {FLAGS}, differ, and are at most 32")
    return found


def translated(flags: Bits, names: Sequence[str], into: Sequence[str]) -> Bits:
    """Return flags whose bits are named by `names` with bits named by `into`, which holds them all."""
    if tuple(names) == tuple(into)[: len(names)]:
        return flags
    out = np.zeros_like(flags)
    for k, name in enumerate(names):
        out[(flags & np.uint32(1 << k)) != 0] |= np.uint32(1 << list(into).index(name))
    return out


def _bit(name: str) -> np.uint32:
    return np.uint32(1 << FLAGS.index(name))


def counted(flags: npt.NDArray[np.uint32], names: Sequence[str]) -> dict[str, int]:
    """Return how many values carry each reason, those that occur."""
    counts = {name: int(np.count_nonzero(flags & np.uint32(1 << k))) for k, name in enumerate(names)}
    return {name: count for name, count in counts.items() if count}

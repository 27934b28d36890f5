"""Uncertainties that a file states, or a user on the command line, as components of a scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.scan import Component, Correlation, Scan
from clbrdf.scan.component import root_sum

Array = npt.NDArray[np.float64]

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")

OWN, COMMON, SCALE = "stated uncertainty", "stated common uncertainty", "scale"
"""Names of components: of a column of 1σ, of one of what all values have in common, of a nameless option."""


def stated_components(brdf: Array, sigma: Array | None, common: Array | None) -> tuple[Component, ...]:
    """Return the components of a file with a column of common uncertainty; none of one without.

    Parameters
    ----------
    brdf : (N, W) float64
    sigma, common : (N, W) float64 or None
        1/sr: what differs from value to value, and what all values have in common; NaN where not stated.
    """
    if common is None:
        return ()
    size = np.abs(np.nan_to_num(brdf, posinf=0.0, neginf=0.0))
    share = np.divide(np.nan_to_num(common), size, out=np.zeros_like(size), where=size > 0.0)
    out = [Component(COMMON, share)]
    if sigma is not None:
        out.insert(0, Component(OWN, np.nan_to_num(sigma), False, RANDOM, SYSTEMATIC, RANDOM))
    return tuple(out)


def with_stated(scan: Scan, scale: Mapping[str, float], random: float | None = None) -> Scan:
    """Return a scan with more components, each a fraction of the BRDF.

    Parameters
    ----------
    scan : Scan
        Uncertainties that it has without components become one that is random.
    scale : mapping of str to float
        By name: one error for all values.
    random : float, optional
        Every value for itself.
    """
    more = [Component(name, share) for name, share in scale.items()]
    if random is not None:
        more.insert(0, Component("noise", random, True, RANDOM, SYSTEMATIC, RANDOM))
    if not more:
        return scan
    own = scan.components
    if not own and scan.sigma is not None:
        own = (Component(OWN, np.nan_to_num(scan.sigma), False, RANDOM, SYSTEMATIC, RANDOM),)
    components = (*own, *more)
    with np.errstate(invalid="ignore"):
        total = root_sum(components, scan.brdf)
    unknown = ~np.isfinite(total)
    if scan.sigma is not None and random is None:
        unknown |= np.isnan(scan.sigma)
    return replace(scan, sigma=np.where(unknown, np.nan, total), components=components)


def share_of(text: str, option: str) -> float:
    """Return a fraction written as a percentage, "2%", or as a number, "0.02".

    Raises
    ------
    InputError
        It is neither, or not between 0 and 1.
    """
    plain = text.strip()
    try:
        share = float(plain.removesuffix("%")) / (100.0 if plain.endswith("%") else 1.0)
    except ValueError:
        share = float("nan")
    if not 0.0 < share < 1.0:
        raise InputError(f"{option} {text!r}: write a percentage, as in {option} 2%")
    return share


def scale_map(texts: Sequence[str]) -> dict[str, float]:
    """Read "2%" or "panel=2%" texts.

    Raises
    ------
    InputError
        A text of another form; a name twice.
    """
    out: dict[str, float] = {}
    for text in texts:
        name, _, share = text.rpartition("=")
        name = name.strip() or SCALE
        if name in out:
            raise InputError(
                f"--scale-uncertainty: {name} is given twice; give each a name, as in panel=2% and lamp=1%"
            )
        out[name] = share_of(share, "--scale-uncertainty")
    return out

"""Places of directions and columns of a scan by what they are: angles, wavelengths, bands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import ANGLES

if TYPE_CHECKING:
    from clbrdf.scan.record import Scan

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

Index = slice | Sequence[int] | npt.NDArray[np.bool_] | npt.NDArray[np.intp]
Wanted = float | slice | Iterable[float]

SAME_ANGLE = 1e-6
"""Degrees."""


def places_of(name: str, values: Array, wanted: Wanted, nearest: bool) -> Places:
    """Return the places of values that are asked for, in the order of the values.

    Parameters
    ----------
    name : str
        For the message.
    values : (N,) float64
    wanted : float, slice or sequence of float
        A slice takes from start to stop, both included.
    nearest : bool
        Whether a number stands for the nearest value, or for the same to SAME_ANGLE.

    Raises
    ------
    InputError
        Nothing is left.
    """
    if isinstance(wanted, slice):
        if wanted.step is not None:
            raise InputError(f"{name}: a slice takes from start to stop, and has no step here")
        low = -np.inf if wanted.start is None else float(wanted.start)
        high = np.inf if wanted.stop is None else float(wanted.stop)
        found = np.flatnonzero((values >= low) & (values <= high))
        said = f"from {low:g} to {high:g}"
    else:
        try:
            numbers = np.atleast_1d(np.asarray(wanted, dtype=np.float64))
        except (TypeError, ValueError):
            raise InputError(f"{name} is {wanted!r}; give a number, several, or a slice") from None
        apart = np.abs(values[None, :] - numbers[:, None])
        if nearest:
            found = np.unique(apart.argmin(axis=1))
        else:
            found = np.flatnonzero((apart <= SAME_ANGLE).any(axis=0))
        said = ", ".join(f"{number:g}" for number in numbers)
    if not len(found):
        raise InputError(f"the scan has no {name} {said}; it has {values.min():g} to {values.max():g}")
    return found


def has_near(scan: Scan, wavelength: float) -> bool:
    """Whether one was measured that is as near, nm, as those measured are to each other, or to 1 nm."""
    gap = float(np.diff(scan.wavelength).max()) if len(scan.wavelength) > 1 else 0.0
    return not scan.bands and float(np.abs(scan.wavelength - wavelength).min()) <= max(gap, 1.0)


def selected(scan: Scan, index: Index | tuple[Index, Index]) -> Scan:
    """Return a scan in some directions, and with a second index at some wavelengths.

    Raises
    ------
    InputError
        A place that the scan does not have.
    """
    if isinstance(index, tuple) and len(index) != 2:
        raise InputError(f"{len(index)} indices; a scan has two, directions and wavelengths")
    rows, columns = index if isinstance(index, tuple) else (index, slice(None))
    out = scan
    for what, one, count in (("rows", rows, len(scan)), ("columns", columns, len(scan.wavelength))):
        places = np.arange(count)
        try:
            chosen = np.atleast_1d(places[one])
        except IndexError as error:
            name = "directions" if what == "rows" else "wavelengths"
            raise InputError(f"the scan has {count} {name}, and {error}") from None
        if chosen.shape != places.shape or (chosen != places).any():
            out = getattr(out, what)(chosen)
    return out


def picked(scan: Scan, angles: Mapping[str, Wanted | None], wavelength: Wanted | None) -> Scan:
    """Return a scan in directions of some angles and at some wavelengths; None takes all.

    Raises
    ------
    InputError
        Nothing is left, or wavelengths are asked of a scan of bands.
    """
    places = np.arange(len(scan))
    for name, wanted in angles.items():
        if wanted is not None:
            values = getattr(scan, name)[places]
            places = places[places_of(name, values, wanted, nearest=False)]
    out = selected(scan, places)
    if wavelength is None:
        return out
    if scan.bands:
        raise InputError(f"the scan has the bands {', '.join(scan.bands)} and no wavelengths")
    return out.columns(places_of("wavelength", scan.wavelength, wavelength, nearest=True))


def in_columns(scan: Scan, index: Index) -> Scan:
    """Return a scan at some of its wavelengths, by their places."""
    assert scan.flags is not None
    places = np.arange(len(scan.wavelength))[index]
    return replace(
        scan,
        wavelength=scan.wavelength[places],
        brdf=scan.brdf[:, places],
        sigma=None if scan.sigma is None else scan.sigma[:, places],
        flags=scan.flags[:, places],
        bands=tuple(scan.bands[k] for k in places) if scan.bands else (),
        bandpass=None if scan.bandpass is None else scan.bandpass[places],
        components=tuple(one.columns(places) for one in scan.components),
    )


def in_rows(scan: Scan, index: Index) -> Scan:
    """Return a scan in some of its directions, by their places or where a (N,) mask is True."""
    assert scan.flags is not None
    angles: dict[str, Any] = {name: getattr(scan, name)[index] for name in ANGLES}
    return replace(
        scan,
        **angles,
        brdf=scan.brdf[index],
        sigma=None if scan.sigma is None else scan.sigma[index],
        flags=scan.flags[index],
        solid_angle=None if scan.solid_angle is None else scan.solid_angle[index],
        components=tuple(one.rows(np.arange(len(scan))[index]) for one in scan.components),
    )

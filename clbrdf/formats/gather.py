"""From single values in any order to the rectangle of a scan: directions × wavelengths."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.flags import FLAGS, MOST_FLAGS
from clbrdf.scan import Scan


@dataclass(frozen=True)
class Row:
    """One measured value.

    Attributes
    ----------
    place : str
        Where it stands in its file, for messages.
    sample : str
    wavelength : float
        nm.
    direction : (float, float, float, float)
        θi, φi, θr, φr, degrees.
    brdf, sigma : float
        1/sr; NaN where unknown.
    reasons : frozenset of str
        Why the value is masked; empty for a good one.
    """

    place: str
    sample: str
    wavelength: float
    direction: tuple[float, float, float, float]
    brdf: float
    sigma: float
    reasons: frozenset[str]


def gather(rows: Sequence[Row], sample: str, provenance: Mapping[str, str]) -> Scan:
    """Return the scan that rows of one sample make.

    Wavelengths are sorted; directions keep the order of their first row. The k-th row of a direction at
    a wavelength belongs to the k-th repeat of that direction. What no row gives is flagged
    "not_measured".

    Raises
    ------
    InputError
        More reasons for masking than a scan has bits.
    """
    wavelengths = sorted({row.wavelength for row in rows})
    column = {wavelength: k for k, wavelength in enumerate(wavelengths)}
    own = sorted({reason for row in rows for reason in row.reasons} - set(FLAGS))
    names = (*FLAGS, *own)
    if len(names) > MOST_FLAGS:
        raise InputError(
            f"{rows[0].place}: {len(own)} different flags; at most {MOST_FLAGS - len(FLAGS)} are kept"
        )
    bit = {name: np.uint32(1 << k) for k, name in enumerate(names)}

    seen: Counter[tuple[object, float]] = Counter()
    places: dict[tuple[object, int], int] = {}
    cells = []
    for row in rows:
        repeat = seen[row.direction, row.wavelength]
        seen[row.direction, row.wavelength] += 1
        place = places.setdefault((row.direction, repeat), len(places))
        cells.append((place, column[row.wavelength], row))

    shape = (len(places), len(wavelengths))
    brdf, sigma = np.full(shape, np.nan), np.full(shape, np.nan)
    flags = np.full(shape, bit["not_measured"], dtype=np.uint32)
    for n, w, row in cells:
        brdf[n, w], sigma[n, w] = row.brdf, row.sigma
        flags[n, w] = sum((bit[reason] for reason in row.reasons), start=np.uint32(0))
    directions = np.array([direction for direction, _ in places], dtype=np.float64)
    theta_i, phi_i, theta_r, phi_r = directions.reshape(-1, 4).T
    return Scan(
        theta_i=theta_i,
        phi_i=phi_i,
        theta_r=theta_r,
        phi_r=phi_r,
        wavelength=np.array(wavelengths),
        brdf=brdf,
        sigma=None if np.isnan(sigma).all() else sigma,
        flags=flags,
        flag_names=names,
        sample=sample,
        provenance=provenance,
    )

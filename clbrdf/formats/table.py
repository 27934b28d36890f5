"""Single values in any order, made into the rectangle of a reading."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.formats.reading import Reading, Stated
from clbrdf.scan.flags import FLAGS
from clbrdf.scan.rectangle import arrange

Array = npt.NDArray[np.float64]


class LongTable:
    """Rows of values, added in parts; all angles in one unit."""

    def __init__(self) -> None:
        self._parts: list[tuple[Array, Array, npt.NDArray[np.intp]]] = []
        self._columns: dict[float | str, int] = {}

    def add(
        self,
        theta_i: npt.ArrayLike,
        phi_i: npt.ArrayLike,
        theta_r: npt.ArrayLike,
        phi_r: npt.ArrayLike,
        column: float | str,
        values: Array,
    ) -> None:
        """Add values (M,) of one wavelength, or of the band that a text names."""
        angles = np.broadcast_arrays(theta_i, phi_i, theta_r, phi_r, values)
        place = self._columns.setdefault(column, len(self._columns))
        keys = np.stack([np.asarray(a, dtype=np.float64) for a in angles[:4]], axis=1)
        self._parts.append((keys, np.asarray(values, dtype=np.float64), np.full(len(values), place)))

    def reading(self, path: Path, stated: Stated, **more: Any) -> Reading:
        """Return what was added as one reading.

        Raises
        ------
        InputError
            Wavelengths and bands together, or nothing.
        """
        names = list(self._columns)
        bands = tuple(name for name in names if isinstance(name, str))
        if not names or (bands and len(bands) < len(names)):
            raise InputError(f"{path}: some values have a wavelength and some have none")
        keys = np.concatenate([part[0] for part in self._parts])
        values = np.concatenate([part[1] for part in self._parts])
        columns = np.concatenate([part[2] for part in self._parts])
        waves = np.array([name for name in names if not isinstance(name, str)])
        return long_reading(path, keys, values, columns, waves, bands, stated, **more)


def long_reading(
    path: Path,
    keys: Array,
    values: Array,
    columns: npt.NDArray[np.intp],
    waves: Array,
    bands: tuple[str, ...],
    stated: Stated,
    sigma: Array | None = None,
    common: Array | None = None,
    flags: npt.NDArray[np.uint32] | None = None,
    lines: Array | None = None,
    **more: Any,
) -> Reading:
    """Return single values (M,) as a reading.

    Parameters
    ----------
    keys : (M, 4) float64
        θi, φi, θr, φr.
    columns : (M,) intp
        Places in `waves` or `bands`.
    sigma, common, flags, lines : (M,) or None
    more
        Further attributes of the reading.

    Raises
    ------
    InputError
        Values that fill next to nothing of the rectangle.
    """
    if not bands:
        waves, back = np.unique(waves, return_inverse=True)
        columns = np.asarray(back.reshape(-1)[columns], dtype=np.intp)
    try:
        rectangle = arrange(keys, columns, len(waves) or len(bands))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    given = np.zeros(len(values), np.uint32) if flags is None else flags
    theta_i, phi_i, theta_r, phi_r = keys[rectangle.first].T
    return Reading(
        np.ascontiguousarray(theta_i),
        np.ascontiguousarray(phi_i),
        np.ascontiguousarray(theta_r),
        np.ascontiguousarray(phi_r),
        np.asarray(rectangle.filled(values, np.nan), dtype=np.float64),
        waves if not bands else np.empty(0),
        bands,
        stated,
        sigma=None if sigma is None else np.asarray(rectangle.filled(sigma, np.nan), dtype=np.float64),
        common=None if common is None else np.asarray(rectangle.filled(common, np.nan), dtype=np.float64),
        flags=np.asarray(rectangle.filled(given, 1 << FLAGS.index("not_measured")), dtype=np.uint32),
        lines=None if lines is None else lines[rectangle.first],
        **more,
    )

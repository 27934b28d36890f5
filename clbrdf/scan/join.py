"""Several scans as one: the arguments of the scan that they make together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import ANGLES
from clbrdf.scan.component_join import joined_components
from clbrdf.scan.effects import Effects, effect_rows
from clbrdf.scan.flags import FLAGS, check_flag_names, translated
from clbrdf.scan.rectangle import arrange
from clbrdf.scan.storage import POLARISATIONS

Array = npt.NDArray[np.float64]
Parts = Sequence[Mapping[str, Any]]
"""The attributes of each scan, by name."""


def joined(parts: Parts) -> dict[str, Any]:
    """Return the attributes of the scan that several make; see `Scan.merge`.

    Raises
    ------
    InputError
        No scans; scans of bands and of wavelengths, of different polarisation or effects, or with more
        reasons for masking than a scan has bits.
    """
    if not parts:
        raise InputError("no scans to merge")
    for name in POLARISATIONS:
        found = sorted({str(part[name]) for part in parts})
        if len(found) > 1:
            raise InputError(f"scans of different {name} ({', '.join(found)}) do not merge; keep them apart")
    if any(part["effects"] != parts[0]["effects"] for part in parts):
        different = dict.fromkeys(_effect_words(part["effects"]) for part in parts)
        raise InputError(f"scans of different effects ({'; '.join(different)}) do not merge; keep them apart")
    if len({bool(part["bands"]) for part in parts}) > 1:
        raise InputError("scans of bands and scans of wavelengths do not merge; keep them apart")
    own = dict.fromkeys(name for part in parts for name in part["flag_names"] if name not in FLAGS)
    names = check_flag_names((*FLAGS, *own))
    axis, places = _columns(parts)
    text = {
        "sample": " + ".join(dict.fromkeys(part["sample"] for part in parts if part["sample"])),
        "instrument": " + ".join(dict.fromkeys(part["instrument"] for part in parts if part["instrument"])),
    }
    return {
        **text,
        **axis,
        **{name: parts[0][name] for name in (*POLARISATIONS, "effects")},
        "flag_names": names,
        "provenance": _provenance([part["provenance"] for part in parts]),
        "bandpass": _bandpass(parts, places, len(axis["wavelength"])),
        **_values(parts, places, len(axis["wavelength"]), names),
    }


def _effect_words(effects: Effects) -> str:
    return ", ".join(f"{name} of {settings}" for name, settings in effect_rows(effects)) or "none"


def _columns(parts: Parts) -> tuple[dict[str, Any], list[npt.NDArray[np.intp]]]:
    """Return the axis of all columns, and the places of each scan's columns on it."""
    if parts[0]["bands"]:
        bands = list(dict.fromkeys(band for part in parts for band in part["bands"]))
        where = [np.array([bands.index(band) for band in part["bands"]], dtype=np.intp) for part in parts]
        return {"bands": tuple(bands), "wavelength": np.full(len(bands), np.nan)}, where
    waves: Array = np.unique(np.concatenate([part["wavelength"] for part in parts]))
    return {"wavelength": waves}, [np.asarray(waves.searchsorted(part["wavelength"])) for part in parts]


def _values(
    parts: Parts, places: list[npt.NDArray[np.intp]], columns: int, names: tuple[str, ...]
) -> dict[str, Any]:
    flags = [translated(part["flags"], part["flag_names"], names) for part in parts]
    has_sigma = any(part["sigma"] is not None for part in parts)
    has_angle = any(part["solid_angle"] is not None for part in parts)
    keys = [
        np.column_stack(
            [*(part[name] for name in ANGLES), _or_nan(part["solid_angle"], len(part["theta_i"]))]
        )
        for part in parts
    ]
    sigma = [_or_nan(part["sigma"], part["brdf"].shape) for part in parts] if has_sigma else []
    sizes = [part["brdf"].size for part in parts]
    ends = np.cumsum(sizes)
    # Where each value comes from, counted through all of them, and each row: scan and place in it.
    origin = [
        np.arange(end - size, end).reshape(part["brdf"].shape)
        for part, size, end in zip(parts, sizes, ends, strict=True)
    ]
    row_origin = [np.column_stack([np.full(len(key), k), np.arange(len(key))]) for k, key in enumerate(keys)]
    if all(len(p) == columns and (p == places[0]).all() for p in places):
        everything, rows, source = np.concatenate(keys), np.concatenate(row_origin), np.concatenate(origin)
        out: dict[str, Any] = {
            "brdf": np.concatenate([part["brdf"] for part in parts]),
            "flags": np.concatenate(flags),
            "sigma": np.concatenate(sigma) if has_sigma else None,
        }
    else:
        cells = [_cells(f) for f in flags]
        rectangle = arrange(
            np.concatenate([key[row] for key, (row, _) in zip(keys, cells, strict=True)]),
            np.concatenate([place[column] for place, (_, column) in zip(places, cells, strict=True)]),
            columns,
        )

        def gathered(matrices: Sequence[npt.NDArray[Any]], empty: float) -> npt.NDArray[Any]:
            flat = [matrix[cell] for matrix, cell in zip(matrices, cells, strict=True)]
            return rectangle.filled(np.concatenate(flat), empty)

        def of_rows(arrays: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
            taken = [array[row] for array, (row, _) in zip(arrays, cells, strict=True)]
            return np.concatenate(taken)[rectangle.first]

        everything, rows, source = of_rows(keys), of_rows(row_origin), gathered(origin, -1)
        out = {
            "brdf": gathered([part["brdf"] for part in parts], np.nan),
            "flags": gathered(flags, 1 << FLAGS.index("not_measured")),
            "sigma": gathered(sigma, np.nan) if has_sigma else None,
        }
    angles = {name: everything[:, k] for k, name in enumerate(ANGLES)}
    first = {int(c): (k, j) for k in reversed(range(len(parts))) for j, c in enumerate(places[k])}
    column_origin = np.array([first[c] for c in range(columns)], dtype=np.intp)
    components = joined_components([part["components"] for part in parts], source, rows, column_origin, sizes)
    return {
        **angles,
        **out,
        "solid_angle": everything[:, len(ANGLES)] if has_angle else None,
        "components": components,
    }


def _cells(flags: npt.NDArray[np.uint32]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return rows and columns of what was measured, and one cell of each row where nothing was."""
    measured = (flags & np.uint32(1 << FLAGS.index("not_measured"))) == 0
    measured[~measured.any(axis=1), 0] = True
    row, column = np.nonzero(measured)
    return row, column


def _or_nan(values: Array | None, shape: int | tuple[int, ...]) -> Array:
    return np.full(shape, np.nan) if values is None else values


def _bandpass(parts: Parts, places: list[npt.NDArray[np.intp]], columns: int) -> Array | None:
    if all(part["bandpass"] is None for part in parts):
        return None
    out = np.full(columns, np.nan)
    for part, place in zip(parts, places, strict=True):
        if part["bandpass"] is not None:
            out[place] = np.where(np.isnan(out[place]), part["bandpass"], out[place])
    return out


def _provenance(given: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """Join what each scan says of its making; where they differ, all of it."""
    keys = dict.fromkeys(key for one in given for key in one)
    return {key: "; ".join(dict.fromkeys(one[key] for one in given if key in one)) for key in keys}

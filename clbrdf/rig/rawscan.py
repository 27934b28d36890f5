"""Everything a measurement recorded, as one record: what calibration starts from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig, read_rig
from clbrdf.rig.row import KINDS, POINT, ROW_FLAGS, columns
from clbrdf.rig.segment import Columns
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]

STS_FULL_SCALE = 16383
"""Stands in files from before a spectrometer's own full scale was stored."""


@dataclass(frozen=True, eq=False)
class RawScan:
    """Raw counts with all that belongs to them.

    Attributes
    ----------
    plan, rig : Plan, Rig
        As they were when it was measured.
    wavelength : (P,) float64
        Of each pixel, nm: the spectrometer's polynomial.
    nonlinearity : (K,) float64
        Polynomial to divide net counts by; empty where linear.
    full_scale : int
        Count from which a scan is saturated.
    is_discrete : bool
        Pixels are single wavelengths: there is nothing to average over.
    rows : mapping of str to (R, …) array
        The columns of :func:`clbrdf.rig.row.columns`.
    log : str
        The log, line by line.
    provenance : mapping of str to str
    """

    plan: Plan
    rig: Rig
    wavelength: Array
    nonlinearity: Array
    full_scale: int
    is_discrete: bool
    rows: Columns
    log: str
    provenance: dict[str, str]

    def point_rows(self) -> npt.NDArray[np.intp]:
        """Rows of the points that are there, (N,), in the order of their numbers; repeats count once.

        Raises
        ------
        InputError
            There is none.
        """
        rows = np.nonzero(self.rows["kind"] == POINT)[0]
        numbers, first = np.unique(self.rows["point"][rows], return_index=True)
        if not len(numbers):
            raise InputError("no point is measured; go on with --resume")
        return np.asarray(rows[first], dtype=np.intp)

    @property
    def directions(self) -> Directions:
        """The directions asked for, one for each of `point_rows`."""
        theta_i, phi_i, theta_r, phi_r = self.rows["nominal"][self.point_rows()].T
        return Directions(theta_i, phi_i, theta_r, phi_r)


def write_raw(entry: h5py.Group, raw: RawScan) -> None:
    """Write the record into an NXentry, as the group `raw`."""
    group = hdf5.group(entry, "raw", "NXcollection")
    group["plan"] = raw.plan.model_dump_json()
    group["rig"] = raw.rig.model_dump_json()
    group["log"] = raw.log
    group["full_scale"] = raw.full_scale
    group["is_discrete"] = raw.is_discrete
    hdf5.field(group, "wavelength", raw.wavelength, "nm", "wavelength of each pixel")
    hdf5.field(group, "nonlinearity", raw.nonlinearity, "", "polynomial to divide net counts by")
    rows = hdf5.group(group, "rows", "NXlog")
    for column in columns(raw.rows["counts"].shape[1]):
        hdf5.field(rows, column.name, raw.rows[column.name], column.units, column.meaning)
    rows["kind"].attrs["names"] = list(KINDS)
    rows["flags"].attrs["names"] = list(ROW_FLAGS)
    hdf5.write_mapping(group, "provenance", raw.provenance)


def read_settings(plan: str, rig: str, path: str | Path) -> tuple[Plan, Rig]:
    """Read the plan and the rig that a file carries as JSON.

    Raises
    ------
    InputError
        They are not what this version knows.
    """
    try:
        return Plan.model_validate_json(plan), read_rig(rig)
    except InputError as error:
        raise InputError(f"{path}: the rig in it cannot be read ({error}); update clbrdf") from error
    except ValidationError as error:
        place = ".".join(str(part) for part in error.errors()[0]["loc"])
        raise InputError(
            f"{path}: the {error.title.lower()} in it cannot be read ({place}); update clbrdf"
        ) from error


def read_raw(path: str | Path) -> RawScan:
    """Read the raw measurement that a scan file carries.

    Raises
    ------
    InputError
        No such file, or a scan that was not measured by a rig of ours.
    """
    with hdf5.open_file(path) as file:
        if "raw" not in file["entry"]:
            raise InputError(f"{path}: carries no raw counts; only scans of 'clbrdf measure' do")
        group = file["entry/raw"]
        plan, rig = read_settings(hdf5.read_text(group, "plan"), hdf5.read_text(group, "rig"), path)
        return RawScan(
            plan,
            rig,
            group["wavelength"][()],
            group["nonlinearity"][()],
            int(group["full_scale"][()]) if "full_scale" in group else STS_FULL_SCALE,
            bool(group["is_discrete"][()]) if "is_discrete" in group else False,
            _read_rows(group),
            hdf5.read_text(group, "log"),
            hdf5.read_mapping(group, "provenance"),
        )


def _read_rows(group: h5py.Group) -> Columns:
    """Return the columns; those that an older file lacks get the values they stood for."""
    rows = group["rows"]
    count, pixels = rows["counts"].shape
    table: Columns = {}
    for column in columns(pixels):
        if column.name in rows:
            table[column.name] = rows[column.name][()].astype(column.dtype, copy=False)
        else:
            table[column.name] = np.full((count, *column.shape), column.missing, column.dtype)
    if "planned_theta_i" in group:
        points = table["point"]
        own = points >= 0
        for place, name in ((0, "theta_i"), (2, "theta_r"), (3, "phi")):
            table["nominal"][own, place] = group[f"planned_{name}"][()][points[own]]
        table["nominal"][own, 1] = 0.0
    return table


def count_kinds(raw: RawScan) -> dict[str, int]:
    """How many rows of each kind there are."""
    return {name: int(np.count_nonzero(raw.rows["kind"] == k)) for k, name in enumerate(KINDS)}

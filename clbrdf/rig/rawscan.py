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
from clbrdf.rig.errors import go_on
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig, read_rig
from clbrdf.rig.row import KINDS, POINT, ROW_FLAGS, columns, row_items
from clbrdf.rig.rowcheck import check_rows
from clbrdf.rig.segment import Columns
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, check_group, read_items

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]

STS_FULL_SCALE = 16383
"""Stands in files from before a spectrometer's own full scale was stored."""

SCHEMA = (
    Item("wavelength", ("P",), units.LENGTH),
    Item("nonlinearity", ("K",)),
    Item("full_scale", kind="whole", required=False),
    Item("is_discrete", kind="truth", required=False),
)
"""Arrays beside the rows, P pixels."""

PLANNED = ((0, "theta_i"), (2, "theta_r"), (3, "phi"))
"""Places in a nominal direction of the angles that the first version wrote by point."""


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

    Raises
    ------
    InputError
        A row says what no measurement writes; `clbrdf.rig.rowcheck` tells what rows may say.
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

    def __post_init__(self) -> None:
        """Refuse rows that no measurement writes."""
        check_rows(self.rows)

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
            raise InputError(f"no point is measured; {go_on()}")
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
        try:
            entry = hdf5.find_entry(file, path)
            if "raw" not in entry:
                raise InputError("carries no raw counts; only scans of 'clbrdf measure' do")
            return _read(entry["raw"], path)
        except InputError as error:
            raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def _read(group: h5py.Group, path: str | Path) -> RawScan:
    check_group(group)
    plan, rig = read_settings(hdf5.read_text(group, "plan"), hdf5.read_text(group, "rig"), path)
    rows = _read_rows(group)
    pixels = rows["counts"].shape[1]
    arrays = read_items(group, SCHEMA, {"P": pixels})
    return RawScan(
        plan,
        rig,
        arrays["wavelength"],
        arrays["nonlinearity"],
        int(arrays.get("full_scale", STS_FULL_SCALE)),
        bool(arrays.get("is_discrete", False)),
        rows,
        hdf5.read_text(group, "log"),
        hdf5.read_mapping(group, "provenance"),
    )


def _read_rows(group: h5py.Group) -> Columns:
    """Return the columns; those that an older file lacks get the values they stood for."""
    found = read_items(group["rows"], row_items(all_required=False))
    count, pixels = found["counts"].shape
    table: Columns = {}
    for column in columns(pixels):
        if column.name in found:
            table[column.name] = found[column.name].astype(column.dtype)
        else:
            table[column.name] = np.full((count, *column.shape), column.missing, column.dtype)
    if "planned_theta_i" in group:
        items = [Item(f"planned_{name}", ("K",), units.ANGLE) for _, name in PLANNED]
        planned, points = read_items(group, items), table["point"]
        own = points >= 0
        if own.any() and points.max() >= len(planned["planned_phi"]):
            raise InputError(f"{group.name}/rows/point holds {points.max()}, which the plan does not have")
        for place, name in PLANNED:
            table["nominal"][own, place] = planned[f"planned_{name}"][points[own]]
        table["nominal"][own, 1] = 0.0
    return table


def count_kinds(raw: RawScan) -> dict[str, int]:
    """How many rows of each kind there are."""
    return {name: int(np.count_nonzero(raw.rows["kind"] == k)) for k, name in enumerate(KINDS)}

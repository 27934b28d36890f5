"""Everything a measurement recorded, as one record: what calibration starts from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from clbrdf import hdf5
from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.row import KINDS, POINT, ROW_FLAGS, columns
from clbrdf.rig.segment import Columns

if TYPE_CHECKING:
    import h5py

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RawScan:
    """Raw counts with all that belongs to them.

    Attributes
    ----------
    plan, rig : Plan, Rig
        As they were when it was measured.
    directions : Directions
        The route's points, planned, N.
    wavelength : (P,) float64
        Of each pixel, nm: the spectrometer's polynomial.
    nonlinearity : (K,) float64
        Polynomial to divide net counts by; empty where linear.
    rows : mapping of str to (R, …) array
        The columns of :func:`clbrdf.rig.row.columns`.
    log : str
        The log, line by line.
    provenance : mapping of str to str
    """

    plan: Plan
    rig: Rig
    directions: Directions
    wavelength: Array
    nonlinearity: Array
    rows: Columns
    log: str
    provenance: dict[str, str]

    def point_rows(self) -> npt.NDArray[np.intp]:
        """Rows of the points, (N,), in the order of the route.

        Raises
        ------
        InputError
            A point is missing.
        """
        places = np.full(len(self.directions), -1, np.intp)
        for row in np.nonzero(self.rows["kind"] == POINT)[0][::-1]:
            places[int(self.rows["point"][row])] = row
        if (places < 0).any():
            missing = int(np.count_nonzero(places < 0))
            raise InputError(f"{missing} of {len(places)} points are not measured; go on with --resume")
        return places


def write_raw(entry: h5py.Group, raw: RawScan) -> None:
    """Write the record into an NXentry, as the group `raw`."""
    group = hdf5.group(entry, "raw", "NXcollection")
    group["plan"] = raw.plan.model_dump_json()
    group["rig"] = raw.rig.model_dump_json()
    group["log"] = raw.log
    for name in ("theta_i", "theta_r", "phi"):
        hdf5.field(group, f"planned_{name}", getattr(raw.directions, name), "deg")
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
        return Plan.model_validate_json(plan), Rig.model_validate_json(rig)
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
        count = group["rows/counts"].shape[1]
        return RawScan(
            plan,
            rig,
            Directions.relative(*(group[f"planned_{name}"][()] for name in ("theta_i", "theta_r", "phi"))),
            group["wavelength"][()],
            group["nonlinearity"][()],
            {column.name: group[f"rows/{column.name}"][()] for column in columns(count)},
            hdf5.read_text(group, "log"),
            hdf5.read_mapping(group, "provenance"),
        )


def count_kinds(raw: RawScan) -> dict[str, int]:
    """How many rows of each kind there are."""
    return {name: int(np.count_nonzero(raw.rows["kind"] == k)) for k, name in enumerate(KINDS)}

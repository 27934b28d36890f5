"""A few rows of a running measurement as a raw scan of their own, to calibrate a point as it comes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from clbrdf.rig.planfile import Plan
from clbrdf.rig.rawscan import RawScan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.row import NO_ROW, Row, columns, row_values
from clbrdf.rig.store import Store


def rows_alone(plan: Plan, rig: Rig, store: Store, header: Mapping[str, str], rows: list[Row]) -> RawScan:
    """Return a raw scan of an incident power and a point, with their darks before them, and nothing else.

    Longer exposures of the point are left out.

    Parameters
    ----------
    plan, rig, store
        Of the measurement.
    header : mapping of str to str
        What a segment says of the spectrometer.
    rows : list of Row
        The incident power, then the point.
    """
    count = len(rows)
    darks = [replace(store.dark_of(row), dark=NO_ROW) for row in rows]
    own = [
        replace(row, dark=place, direct=count if place else NO_ROW, rung=NO_ROW)
        for place, row in enumerate(rows)
    ]
    values = [row_values(row) for row in (*darks, *own)]
    names = [column.name for column in columns(len(rows[0].counts))]
    return RawScan(
        plan,
        rig,
        np.array(json.loads(header["wavelength"])),
        np.array(json.loads(header["nonlinearity"])),
        int(header["full_scale"]),
        header["is_discrete"] == "1",
        {name: np.stack([v[k] for v in values]) for k, name in enumerate(names)},
        "",
        {},
    )

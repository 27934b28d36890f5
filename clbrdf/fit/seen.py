"""What the detector sees, as kernels take it: one of kernels/lib/seen_*.cl, and its arrays on the device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.observation import ForwardModel
from clbrdf.opencl.device import Device
from clbrdf.opencl.program import upload

if TYPE_CHECKING:
    import pyopencl as cl

POINTS, NODES, BEAMS = "seen_point", "seen_nodes", "seen_beams"
"""A direction is a point; nodes that share its incident direction; nodes that have their own."""


def library_of(seen: ForwardModel) -> str:
    """Return the file of kernels/lib that a forward model needs: the cheapest that can say it."""
    if seen.first is None:
        return POINTS
    return NODES if len(_beams(seen)) == len(seen) + 1 else BEAMS


def upload_seen(device: Device, seen: ForwardModel, dtype: type[np.generic]) -> tuple[cl.Buffer, ...]:
    """Return the arguments that OBSERVATION of the library stands for."""
    rows = upload(device, seen.features, dtype)
    if seen.first is None or seen.weight is None:
        return (rows,)
    weight, first = upload(device, seen.weight, dtype), upload(device, seen.first, np.uint32)
    beams = _beams(seen)
    if len(beams) == len(seen) + 1:
        return rows, first, weight
    groups = np.searchsorted(beams, seen.first)
    return rows, upload(device, groups, np.uint32), upload(device, beams, np.uint32), weight


def _beams(seen: ForwardModel) -> Any:
    """Return where nodes of one measured direction and one incident direction begin, (B + 1,); last, K."""
    assert seen.first is not None
    incident = seen.features[:, : seen.model.incident_features]
    begins = np.zeros(len(incident) + 1, dtype=np.bool_)
    begins[1:-1] = (incident[1:] != incident[:-1]).any(axis=1)
    begins[seen.first] = True
    return np.flatnonzero(begins)

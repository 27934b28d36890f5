"""How the directions of a scan lie side by side in a fit; formed once, whatever the number of wavelengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.fit.sample import MANY, SAMPLE, DirectionSample, sample_of
from clbrdf.geometry import Directions, mirror_distance
from clbrdf.models import Model
from clbrdf.observation import ForwardModel, Observation
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.values import features_in_parts
from clbrdf.scan.rectangle import group_numbers

Array = npt.NDArray[np.float64]

PART = 1 << 14
"""Directions that are looked at at once."""


@dataclass(frozen=True, eq=False)
class Layout:
    """N directions, those with one incident direction side by side.

    Attributes
    ----------
    order : (N,) int
        Place in the scan of each.
    features : (N, F) float64
        Geometry features of the model, in this order.
    starts : (I + 1,) uint32
        Where each group of one incident direction begins; last, N.
    mirror : (N,) float64
        Distance from the mirror direction, a quarter of |β − β0|² in direction cosines.
    seen : ForwardModel
        What the detector sees in them.
    sample : DirectionSample or None
        Of these directions, in this order, where they are many.
    """

    order: npt.NDArray[np.intp]
    features: Array
    starts: npt.NDArray[np.uint32]
    mirror: Array
    seen: ForwardModel
    sample: DirectionSample | None


def layout_of(model: Model, directions: Directions, observation: Observation | None = None) -> Layout:
    """Return the layout of directions for a model; they are points if no observation is given."""
    n = len(directions)
    features, mirror = features_in_parts(model, directions, get_precision("double")), np.empty(n)
    for first in range(0, n, PART):
        mirror[first : first + PART] = mirror_distance(directions[first : first + PART])
    incident = features[:, : model.incident_features]
    group = group_numbers(incident) if incident.shape[1] else np.zeros(n, dtype=np.intp)
    order = np.argsort(group, kind="stable")
    for column in (*features.T, mirror):  # one after the other: a second whole array is not needed
        column[:] = column[order]
    starts = np.append(0, np.cumsum(np.bincount(group))).astype(np.uint32)
    seen = ForwardModel(model, features)
    if observation is not None and not observation.is_points:
        seen = ForwardModel.of(model, observation.take(order))
    sample = sample_of(mirror, SAMPLE) if n > MANY else None
    return Layout(order, features, starts, mirror, seen, sample)

"""The references and the package as one kind of function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

import clbrdf
from tests.oracles.agreement import Directions
from tests.reference.models import REFERENCES


@dataclass(frozen=True)
class Subject:
    """Who is compared: BRDF values of a model by name, and the relative error that it may have itself."""

    values: Callable[[str, Mapping[str, float], Directions, float | None], np.ndarray]
    bound: float


def _reference(name, parameters, directions, wavelength):
    value = REFERENCES[name].value
    rows = zip(*directions, strict=True)
    return np.array([float(value(parameters, i, 0.0, r, phi, wavelength)) for i, r, phi in rows])


def _package(name, parameters, directions, wavelength):
    more = {"wavelength": wavelength} if REFERENCES[name].needs_wavelength else {}
    return clbrdf.evaluate(parameters, *directions, model=name, **more)


SUBJECTS = {
    "reference": Subject(_reference, 0.0),
    "package": Subject(_package, 1e-11),  # what double precision promises for every model
}

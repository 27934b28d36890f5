"""Where the incident zeniths of a file are best placed.

Interpolation over θi makes the larger part of the error. With an error e(θi) h² of a cell of width h the
sum of errors is the smallest where the density of nodes goes with the cube root of e: the rule for
linear interpolation in the mean (C. de Boor, "Good approximation by splines with variable knots", 1973,
doi:10.1007/978-3-0348-5979-0_3). e is measured on a coarse file, twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.formats.rgl.accuracy import LAST_INCIDENT, measure_accuracy
from clbrdf.formats.rgl.material import Material
from clbrdf.formats.rgl.parametrise import TableLayout, make_tables
from clbrdf.formats.rgl.values import TensorReader

Array = npt.NDArray[np.float64]

LAST_NODE = np.deg2rad(88.0)
"""The last stored incident zenith; beyond, its values hold."""

COARSE_NODES, COARSE_SIDE = 24, 40
ROUNDS = 2
VIEWS = 256
BEYOND = 0.03
"""Weight of errors beyond the incident zeniths for which a tolerance holds."""

BRIGHT = 0.3
"""Share of the weight that goes with the size of the BRDF at an incident zenith; the rest is even."""


@dataclass(frozen=True, eq=False)
class Incidence:
    """A density of incident zeniths, as its integral.

    Attributes
    ----------
    share : (M,) float64
        Increasing from 0 to 1.
    theta_i : (M,) float64
        Radians.
    """

    share: Array
    theta_i: Array

    def nodes(self, count: int) -> Array:
        """Return `count` incident zeniths, radians."""
        return np.interp(np.linspace(0.0, 1.0, count), self.share, self.theta_i)


def best_incidence(material: Material, profile: Array) -> Incidence:
    """Measure how the error goes with the incident zenith and return where nodes belong."""
    # From 0.8 as the exponent, which suits many materials.
    incidence = Incidence(np.linspace(0.0, 1.0, 64), LAST_NODE * np.linspace(0.0, 1.0, 64) ** 0.8)
    bands = material.steering_bands
    for _ in range(ROUNDS):
        nodes = incidence.nodes(COARSE_NODES)
        reader = TensorReader(make_tables(material, TableLayout(nodes, COARSE_SIDE), profile, bands))
        width = np.diff(nodes)
        inside = np.sort(np.concatenate([nodes[:-1] + part * width for part in (0.3, 0.7)]))
        found = measure_accuracy(material, reader, bands, np.rad2deg(inside), VIEWS)
        error = found.by_incident.reshape(-1, 2).mean(axis=1)
        size = found.size_by_incident.reshape(-1, 2).mean(axis=1)
        checked = nodes[:-1] + width / 2.0 < np.deg2rad(LAST_INCIDENT)
        bright = np.minimum(size / size[checked].mean(), 10.0)
        weight = np.where(checked, 1.0 - BRIGHT + BRIGHT * bright, BEYOND)
        density = np.cbrt(error * weight / width**2)
        density = np.convolve(np.pad(density, 1, "edge"), [0.25, 0.5, 0.25], "valid")
        density = np.maximum(density, 0.1 * (density @ width) / nodes[-1])
        share = np.concatenate([[0.0], np.cumsum(density * width)])
        incidence = Incidence(share / share[-1], nodes)
    return incidence

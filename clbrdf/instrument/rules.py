"""Which nodes stand for a cone: its axis alone, rings about its axis, or circles about where a lobe may peak.

Rings need the fewest nodes where a lobe is smooth over the cone. Cusps, and lobes narrower than the cone,
want the rule that gathers its nodes at the peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from clbrdf.instrument.cone import cone_nodes
from clbrdf.instrument.rings import ring_nodes

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Rule:
    """How nodes are placed in a cone.

    Attributes
    ----------
    kind : "point", "rings" or "peak"
        The axis alone; `clbrdf.instrument.rings`; `clbrdf.instrument.cone`.
    order : int
        Rings, or nodes on a circle.
    """

    kind: Literal["point", "rings", "peak"]
    order: int = 1

    @property
    def name(self) -> str:
        """In a few letters, such as "rings 2"."""
        return self.kind if self.kind == "point" else f"{self.kind} {self.order}"

    @property
    def count(self) -> int:
        """Nodes of a cone."""
        if self.kind == "point":
            return 1
        rings = 3 if self.order == 1 else self.order * (4 * self.order - 2)
        return rings if self.kind == "rings" else 2 * self.order**2

    def nodes(self, axis: Array, peak: Array, half_angle: Array) -> tuple[Array, Array]:
        """Return nodes (N, K, 3) and shares (N, K), which add up to 1, over cones about axes.

        Half-angles (N,) are in radians. Axes and the directions where a lobe may peak are (N, 3).
        """
        if self.kind == "point":
            return axis[:, None, :], np.ones((len(axis), 1))
        if self.kind == "rings":
            return ring_nodes(axis, peak, half_angle, self.order)
        nodes, weights = cone_nodes(axis, peak, half_angle, self.order)
        return nodes, weights / weights.sum(axis=1, keepdims=True)


POINT = Rule("point")


LADDER = (
    POINT,
    *(Rule("rings", order) for order in (1, 2, 3, 4)),
    *(Rule("peak", order) for order in (6, 8, 12, 16, 24, 32, 48)),
)
"""What is tried one after the other, each with more nodes than the one before: rings while a lobe is smooth
over the cone, then circles about its peak."""

CONES = ("beam", "aperture")
"""Effects that spread light over a cone, in the order of the columns of levels."""

"""What a page holds of the instrument behind a fit: its nodes, or what the detector sees at the optimum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.result import Fit
from clbrdf.fit.words import through_lines
from clbrdf.observation import Observation
from clbrdf.viz.page.pack import packed, packed_angles
from clbrdf.viz.page.thin import Thinning

NODE_SHARE = 0.35
"""Of the bytes of a page, that nodes may take."""

SAME = 1e-9
"""Degrees: incident directions of nodes that agree to this with the measured one are it."""


@dataclass(frozen=True, eq=False)
class Seen:
    """The instrument behind a fit.

    Attributes
    ----------
    fit : Fit
    nodes : Observation or None
        From them the page computes what is seen for any parameters. None where it cannot.
    why : str
        Why there are no nodes; the page then holds what is seen at the optimum.
    """

    fit: Fit
    nodes: Observation | None
    why: str = ""

    @property
    def shares_incident(self) -> bool:
        """Whether all nodes have the incident direction of the measured one."""
        assert self.nodes is not None
        at, scan = self.nodes.nodes, self.fit.scan
        return all(
            np.allclose(there, here[self.nodes.owner], rtol=0.0, atol=SAME)
            for there, here in ((at.theta_i, scan.theta_i), (at.phi_i, scan.phi_i))
        )

    @property
    def bytes(self) -> int:
        """Of the nodes, before they are text."""
        return 0 if self.nodes is None else _node_bytes(self.nodes, self.shares_incident)

    @property
    def more(self) -> int:
        """Numbers that are kept beside each measured value."""
        return int(self.nodes is None)

    def words(self) -> str:
        """Return what measured values are compared with, in a sentence or two."""
        said = (
            "Deviations and E compare measured values with what the detector sees through:"
            f" {through_lines(self.fit)[0]}. Lobe, lines and the map of the model are the surface's own."
        )
        if self.nodes is None:
            said += f" With parameters set by hand there are neither deviations nor E: {self.why}."
        return said

    def record(self, thin: Thinning) -> dict[str, Any]:
        """Return it as a mapping that JSON takes, for the directions and wavelengths that are kept."""
        out: dict[str, Any] = {"words": self.words(), "why": self.why, "nodes": None, "observed": None}
        if self.nodes is None:
            out["observed"] = packed(self.fit.observed()[np.ix_(thin.rows, thin.columns)], thin.kind)
            return out
        kept = self.nodes.take(thin.rows)
        shared = self.shares_incident
        out["nodes"] = {
            "count": packed(np.bincount(kept.owner, minlength=len(thin.rows)), "i4"),
            "weight": packed(kept.weight),
            "theta_i": None if shared else packed_angles(kept.nodes.theta_i),
            "phi_i": None if shared else packed_angles(kept.nodes.phi_i),
            "theta_r": packed_angles(kept.nodes.theta_r),
            "phi": packed_angles(kept.nodes.turn),
        }
        return out


def seen_of(fit: Fit | None, budget: int) -> Seen | None:
    """Return what a page of `budget` bytes holds of the instrument; None for fits of points."""
    if fit is None or fit.through is None:
        return None
    if fit.through.instrument.bandwidth is not None:
        return Seen(fit, None, "the slit ties neighbouring wavelengths")
    found = Seen(fit, fit.observation.folded(fit.model))
    if found.bytes <= NODE_SHARE * budget:
        return found
    assert found.nodes is not None
    return Seen(fit, None, f"{len(found.nodes.nodes)} nodes of the instrument are too many for a page")


def _node_bytes(nodes: Observation, shared: bool) -> int:
    columns: list[npt.NDArray[np.float64]] = [nodes.weight, nodes.nodes.theta_r, nodes.nodes.turn]
    return (len(columns) + (0 if shared else 2)) * 8 * len(nodes.nodes)

"""Means over aperture, beam and slit, each with as many nodes as the tolerance asks for.

Every direction goes its own way: its orders rise, one kind of integral after the other, until a step
changes no wavelength by more than its share of the tolerance. What is returned is the finer of the last
two, so that the error is well below the change that ended the search.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.instrument.aperture import aperture_nodes
from clbrdf.instrument.bandwidth import slit_nodes
from clbrdf.instrument.beam import beam_nodes
from clbrdf.instrument.rules import Rule
from clbrdf.instrument.vectors import directions_of, pair_of_vectors
from clbrdf.scene.scenefile import Effects
from clbrdf.scene.surface import Surface

Array = npt.NDArray[np.float64]

ORDERS = {
    "aperture": (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64),
    "beam": (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64),
    "bandwidth": (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32),
}
"""By effect, what is tried one after the other: nodes on a radius and on a circle, on half a slit
(0: its middle alone)."""

INTEGRATED = tuple(ORDERS)
MOST_NODES = 1 << 18
"""Directions of one launch, nodes counted: some 50 MiB of geometry."""


@dataclass
class Told:
    """What the search had to leave: by effect, how many directions, and the largest last change."""

    short: dict[str, tuple[int, float]] = field(default_factory=dict)

    def add(self, effect: str, count: int, change: float) -> None:
        """Count directions whose highest order still changed the result by more than allowed."""
        before, largest = self.short.get(effect, (0, 0.0))
        self.short[effect] = before + count, max(largest, change)


def check_horizon(effects: Effects, directions: Directions) -> None:
    """Raise InputError where a cone reaches below the horizon, where no model has a value."""
    for name, word, zenith in (
        ("aperture", "θr", directions.theta_r),
        ("beam", "θi", directions.theta_i),
    ):
        settings = getattr(effects, name)
        if settings is not None and zenith.max() + settings.angle / 2.0 >= 89.999:
            limit = 89.999 - settings.angle / 2.0
            raise InputError(
                f"effects.{name}: a cone of {settings.angle:g}° about {word} = {zenith.max():g}° reaches"
                f" below the horizon; stay below {limit:g}°, or make the angle smaller"
            )


def integrate(
    surface: Surface,
    effects: Effects,
    directions: Directions,
    wavelength: Array,
    rtol: float,
    told: Told,
) -> Array:
    """Return the means (N, W) over the integrated effects that are on, within a relative tolerance."""
    axes = [name for name in INTEGRATED if getattr(effects, name) is not None]
    level = np.zeros((len(directions), len(axes)), np.intp)
    result = _at_levels(surface, effects, axes, directions, wavelength, level)
    for j, name in enumerate(axes):
        active = np.arange(len(directions))
        while active.size:
            level[active, j] += 1
            finer = _at_levels(surface, effects, axes, directions[active], wavelength, level[active])
            with np.errstate(divide="ignore", invalid="ignore"):
                change = np.abs(finer / result[active] - 1.0)
            change = np.where(np.isnan(change), 0.0, change).max(axis=1)
            result[active] = finer
            open_ = change > rtol / len(axes)
            last = level[active, j] == len(ORDERS[name]) - 1
            if (open_ & last).any():
                told.add(name, int(np.count_nonzero(open_ & last)), float(change[open_ & last].max()))
            active = active[open_ & ~last]
    return result


def _at_levels(
    surface: Surface,
    effects: Effects,
    axes: list[str],
    directions: Directions,
    wavelength: Array,
    level: npt.NDArray[np.intp],
) -> Array:
    """Return means (N, W) with the orders of each direction's levels (N, axes)."""
    out = np.empty((len(directions), len(wavelength)))
    for kind in np.unique(level, axis=0):
        places = np.nonzero((level == kind).all(axis=1))[0]
        orders = {name: ORDERS[name][k] for name, k in zip(axes, kind, strict=True)}
        count = 1
        for name in ("aperture", "beam"):
            count *= 2 * orders[name] ** 2 if name in orders else 1
        step = max(1, MOST_NODES // count)
        for first in range(0, len(places), step):
            part = places[first : first + step]
            out[part] = mean_of_orders(surface, effects, directions[part], wavelength, orders)
    return out


def mean_of_orders(
    surface: Surface, effects: Effects, directions: Directions, wavelength: Array, orders: dict[str, int]
) -> Array:
    """Return the means (N, W) with given orders, in one launch."""
    n = len(directions)
    source, view = pair_of_vectors(directions)
    weights: Array | None = None
    if effects.beam is not None:
        nodes, weights = beam_nodes(effects.beam, source, view, Rule("peak", orders["beam"]))
        source, view = nodes.reshape(-1, 3), np.repeat(view, nodes.shape[1], axis=0)
    if effects.aperture is not None:
        nodes, shares = aperture_nodes(effects.aperture.angle, source, view, Rule("peak", orders["aperture"]))
        source, view = np.repeat(source, nodes.shape[1], axis=0), nodes.reshape(-1, 3)
        outer = np.ones((n, 1)) if weights is None else weights
        weights = (outer[..., None] * shares.reshape(n, -1, nodes.shape[1])).reshape(n, -1)
    seen = directions if weights is None else directions_of(source, view)
    if effects.bandwidth is None:
        return surface.mean(seen, weights, wavelength, np.zeros(1), None)
    offsets, band_shares = slit_nodes(effects.bandwidth, orders["bandwidth"])
    return surface.mean(seen, weights, wavelength, offsets, band_shares)

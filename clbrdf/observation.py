"""What the detector sees: weighted means of a model over nodes, the directions about each measured one.

A measurement is never of one direction. Aperture and beam are cones; whatever spreads or moves directions is
said by nodes and their weights. A point is the case of one node of weight 1, and costs what a model value
costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import Model

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Observation:
    """N measured directions by K nodes: the value seen in direction n is Σ weight · f(node) over its nodes.

    Attributes
    ----------
    nodes : Directions
        K.
    owner : (K,) int
        The measured direction of each node, 0 to N − 1, none left out, not decreasing.
    weight : (K,) float64
        Finite. Those of one direction add up to 1 where the instrument spreads light and loses none.

    Raises
    ------
    InputError
        Lengths that do not agree, an owner that is left out or out of order, a weight that is not finite.

    Examples
    --------
    >>> pair = Directions.relative([30.0, 30.0], [29.0, 31.0], 180.0)
    >>> len(Observation(pair, [0, 0], [0.5, 0.5]))
    1
    """

    nodes: Directions
    owner: Places
    weight: Array

    def __post_init__(self) -> None:
        owner = np.array(self.owner, dtype=np.intp)
        weight = np.array(self.weight, dtype=np.float64)
        count = len(self.nodes)
        if owner.shape != (count,) or weight.shape != (count,):
            raise InputError(
                f"an observation of {count} nodes has owners of shape {owner.shape} and weights of shape"
                f" {weight.shape}; give one of each for every node"
            )
        if count and (owner[0] != 0 or not np.isin(np.diff(owner), (0, 1)).all()):
            raise InputError(
                "owners of nodes count the measured directions from 0, each with its nodes together"
            )
        if not np.isfinite(weight).all():
            raise InputError("weights of nodes have to be finite")
        for name, values in (("owner", owner), ("weight", weight)):
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    @classmethod
    def points(cls, directions: Directions) -> Observation:
        """Return the observation that sees each direction as a point."""
        return cls(directions, np.arange(len(directions)), np.ones(len(directions)))

    def __len__(self) -> int:
        """Measured directions, N."""
        return int(self.owner[-1]) + 1 if len(self.owner) else 0

    @cached_property
    def is_points(self) -> bool:
        """Whether each direction is one node of weight 1."""
        return len(self) == len(self.nodes) and bool((self.weight == 1.0).all())

    @cached_property
    def first(self) -> Places:
        """Place of each direction's first node, (N + 1,); last, K."""
        return np.append(np.searchsorted(self.owner, np.arange(len(self))), len(self.owner)).astype(np.intp)

    def take(self, places: Places | npt.NDArray[np.bool_]) -> Observation:
        """Return the observation of some measured directions, by their places or where a mask is True."""
        chosen = _numbered(places)
        nodes, owner = node_ranges(self.first, chosen)
        return Observation(self.nodes[nodes], owner, self.weight[nodes])

    def folded(self, model: Model) -> Observation:
        """Return the observation with one node where a model cannot tell several of a direction apart.

        Mirror images about the plane of incidence are such, for most models. A point stays itself.
        """
        if self.is_points:
            return self
        kept, weight = _folded(model.features(self.nodes), self.owner, self.weight)
        return Observation(self.nodes[kept], self.owner[kept], weight)


def _numbered(places: Places | npt.NDArray[np.bool_]) -> Places:
    """Return places as numbers, where a mask may be given."""
    return np.flatnonzero(places) if places.dtype == np.bool_ else places.astype(np.intp, copy=False)


def node_ranges(first: Places, chosen: Places) -> tuple[Places, Places]:
    """Return the places (K′,) of the nodes of chosen directions (N′,), and to which of those each belongs."""
    count = first[chosen + 1] - first[chosen]
    owner = np.repeat(np.arange(len(chosen)), count)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return first[chosen][owner] + within, owner


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """A model behind an observation: the one way from parameters to numbers that are compared with data.

    Attributes
    ----------
    model : Model
    features : (K, F) float64
        Geometry features of the nodes.
    first : (N + 1,) int or None
        Where the nodes of each direction begin; last, K. None where all directions are points, K = N.
    weight : (K,) float64 or None
        None for points.
    """

    model: Model
    features: Array
    first: Places | None = None
    weight: Array | None = None

    @classmethod
    def of(cls, model: Model, observation: Observation) -> ForwardModel:
        """Return the forward model of N measured directions.

        Nodes of one direction that are the same to the model, such as mirror images about the plane of
        incidence, become one.
        """
        features = model.features(observation.nodes)
        if observation.is_points:
            return cls(model, features)
        kept, weight = _folded(features, observation.owner, observation.weight)
        first = np.append(np.searchsorted(observation.owner[kept], np.arange(len(observation))), len(kept))
        return cls(model, features[kept], first.astype(np.intp), weight)

    def __len__(self) -> int:
        """Measured directions, N."""
        return len(self.features) if self.first is None else len(self.first) - 1

    def brdf(self, parameters: Array) -> Array:
        """Return what is seen, (..., N), 1/sr, for parameters (..., 1, P)."""
        return self._seen(self.model.brdf(parameters, self.features))

    def jacobian(self, parameters: Array) -> Array:
        """Return its derivatives by the parameters, (..., N, P), for parameters (..., 1, P)."""
        derivatives = self.model.jacobian(parameters, self.features)
        if self.first is None:
            return derivatives
        return np.moveaxis(self._seen(np.moveaxis(derivatives, -1, 0)), 0, -1)

    def take(self, places: Places | npt.NDArray[np.bool_]) -> ForwardModel:
        """Return the forward model of some of the measured directions, by their places or a mask."""
        chosen = _numbered(places)
        if self.first is None or self.weight is None:
            return ForwardModel(self.model, np.ascontiguousarray(self.features[chosen]))
        nodes, _ = node_ranges(self.first, chosen)
        count = self.first[chosen + 1] - self.first[chosen]
        first = np.append(0, np.cumsum(count)).astype(np.intp)
        return ForwardModel(self.model, self.features[nodes], first, self.weight[nodes])

    def _seen(self, values: Array) -> Array:
        """Weighted sums (..., N) of values at the nodes (..., K)."""
        if self.first is None or self.weight is None:
            return values
        return np.asarray(np.add.reduceat(values * self.weight, self.first[:-1], axis=-1))


DIGITS = 12
"""Nodes whose features agree to so many digits are the same to the model: they differ by rounding."""


def _folded(features: Array, owner: Places, weight: Array) -> tuple[Places, Array]:
    """Return the places of nodes that differ, in their order, and their weights, images included."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.where(features == 0.0, 1.0, 10.0 ** np.floor(np.log10(np.abs(features))))
    rounded = np.round(features / size, DIGITS) * size
    # Equal rows have equal sums with weights of no relation; rows of one sum are then compared.
    sums = rounded @ np.sqrt(np.arange(2.0, 2.0 + features.shape[1]))
    order = np.lexsort((sums, owner))
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = (owner[order[1:]] != owner[order[:-1]]) | (rounded[order[1:]] != rounded[order[:-1]]).any(
        axis=1
    )
    kept = order[new]
    total = np.bincount(np.cumsum(new) - 1, weight[order]).astype(np.float64)
    order = np.argsort(kept)
    return kept[order], total[order]

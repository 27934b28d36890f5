"""What every fitting method gets: plain arrays, the same for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import mirror_distance
from clbrdf.models import Model
from clbrdf.objective import residual_scale
from clbrdf.observation import ForwardModel, Observation
from clbrdf.opencl.device import Device
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise E = Σ (s f(x) − s m)² (13) at each of W wavelengths, within limits.

    Searches take each direction as a point; what is compared to the last digit is what the detector sees.

    Attributes
    ----------
    model : Model
    features : (N, F) float64
        Geometry features of the directions, those with one incident direction side by side.
    seen : ForwardModel
        What the detector sees in them, N.
    starts : (I + 1,) uint32
        Where each group of one incident direction begins; last, N.
    target : (W, N) float64
        s m, the scaled BRDF; 0 where masked.
    scale : (W, N) float64
        s = √(g / Σ g m²), sr; 0 where masked.
    lower, upper : (W, P) float64
        Limits in the model's coordinates q; equal for a parameter that is given.
    free : tuple of int
        Places of the parameters that are not given.
    mirror : (N,) float64
        Distance from the mirror direction, a quarter of |β − β0|² in direction cosines.
    keys : (W,) uint32
        Name each wavelength for the random numbers: its picometres, so that a wavelength draws the same
        numbers whatever else is in the scan.
    device : Device
        Runs the kernels.
    order : (N,) int
        Place of each direction in the scan.
    """

    model: Model
    features: Array
    seen: ForwardModel
    starts: npt.NDArray[np.uint32]
    target: Array
    scale: Array
    lower: Array
    upper: Array
    free: tuple[int, ...]
    mirror: Array
    keys: npt.NDArray[np.uint32]
    device: Device
    order: npt.NDArray[np.intp]

    @property
    def size(self) -> tuple[int, int]:
        """(W, N)."""
        w, n = self.target.shape
        return w, n

    def take(self, rows: npt.NDArray[np.intp]) -> Problem:
        """Return the problem at some of its wavelengths."""
        taken = {name: getattr(self, name)[rows] for name in ("target", "scale", "lower", "upper", "keys")}
        return replace(self, **taken)


@dataclass(frozen=True, eq=False)
class Candidates:
    """What a search hands to the polish.

    Attributes
    ----------
    coordinates : (W, K, P) float64
        Starts of the polish, best first.
    evaluations : (W,) int64
        Evaluations of E spent.
    acceptance : (W,) float64
        Share of proposed moves that were taken, [0, 1]; NaN for methods that propose none.
    not_finite : (W,) int64
        Evaluations whose E was not finite; they were refused.
    doubtful : (W,) bool
        Where the search itself saw that it may have to look again.
    first : int
        Starts that are polished first, the others only where these disagree; 0 for all at once.
    rough_iterations : int
        Of the way in single precision; 0 for the usual number.
    off_limits : bool
        Whether ends at a limit are tried again from within.
    """

    coordinates: Array
    evaluations: npt.NDArray[np.int64]
    acceptance: Array
    not_finite: npt.NDArray[np.int64]
    doubtful: npt.NDArray[np.bool_]
    first: int = 0
    rough_iterations: int = 0
    off_limits: bool = False


def make_problem(
    scan: Scan,
    weights: Array,
    model: Model,
    bounds: Array,
    device: Device,
    given: Mapping[str, Array] | None = None,
    observation: Observation | None = None,
) -> Problem:
    """Return the problem that a scan poses.

    Parameters
    ----------
    scan : Scan
        N directions × W wavelengths.
    weights : (N, W) float64
    model : Model
    bounds : (P, 2) float64
        Of the parameters.
    device : Device
    given : mapping of str to (W,) array
        Parameters that are not fitted.
    observation : Observation, optional
        What the detector sees in the N directions; points if not given.
    """
    known = dict(given or {})
    limits = np.repeat(model.coordinate_bounds(bounds)[None], len(scan.wavelength), axis=0)
    for j, row in enumerate(model.parameters):
        if row.name in known:
            limits[:, j] = row.to_coordinate(known[row.name])[:, None]
    features = model.features(scan.directions)
    _, group = np.unique(features[:, : model.incident_features], axis=0, return_inverse=True)
    group = group.ravel()
    order = np.argsort(group, kind="stable")
    scale = residual_scale(scan, weights)[order]
    measured = np.where(scale > 0.0, scan.brdf[order], 0.0)
    ordered = features[order]
    seen = ForwardModel(model, ordered)
    if observation is not None and not observation.is_points:
        seen = ForwardModel.of(model, observation.take(order))
    return Problem(
        model=model,
        features=ordered,
        seen=seen,
        starts=np.append(0, np.cumsum(np.bincount(group))).astype(np.uint32),
        target=np.ascontiguousarray((scale * measured).T),
        scale=np.ascontiguousarray(scale.T),
        lower=np.ascontiguousarray(limits[..., 0]),
        upper=np.ascontiguousarray(limits[..., 1]),
        free=tuple(j for j, row in enumerate(model.parameters) if row.name not in known),
        mirror=mirror_distance(scan.directions)[order],
        keys=scan.column_keys,
        device=device,
        order=order,
    )

"""What every fitting method gets: plain arrays, the same for all of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.device import Device
from clbrdf.models import Model
from clbrdf.objective import residual_scale
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise E = Σ (s f(x) − s m)² (13) at each of W wavelengths, within limits.

    Attributes
    ----------
    model : Model
    features : (N, F) float64
        Geometry features of the directions, those with one incident direction side by side.
    starts : (I + 1,) uint32
        Where each group of one incident direction begins; last, N.
    target : (W, N) float64
        s m, the scaled BRDF; 0 where masked.
    scale : (W, N) float64
        s = √(g / Σ g m²), sr; 0 where masked.
    lower, upper : (P,) float64
        Limits in the model's coordinates q.
    keys : (W,) uint32
        Name each wavelength for the random numbers: its picometres, so that a wavelength draws the same
        numbers whatever else is in the scan.
    device : Device
        Runs the kernels.
    """

    model: Model
    features: Array
    starts: npt.NDArray[np.uint32]
    target: Array
    scale: Array
    lower: Array
    upper: Array
    keys: npt.NDArray[np.uint32]
    device: Device

    @property
    def size(self) -> tuple[int, int]:
        """(W, N)."""
        w, n = self.target.shape
        return w, n

    def take(self, rows: npt.NDArray[np.intp]) -> Problem:
        """Return the problem at some of its wavelengths."""
        return replace(self, target=self.target[rows], scale=self.scale[rows], keys=self.keys[rows])


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
    """

    coordinates: Array
    evaluations: npt.NDArray[np.int64]
    acceptance: Array
    not_finite: npt.NDArray[np.int64]
    doubtful: npt.NDArray[np.bool_]


def make_problem(scan: Scan, weights: Array, model: Model, bounds: Array, device: Device) -> Problem:
    """Return the problem that a scan poses, for weights (N, W) and bounds of the parameters (P, 2)."""
    limits = model.coordinate_bounds(bounds)
    features = model.features(scan.directions)
    _, group = np.unique(features[:, : model.incident_features], axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    scale = residual_scale(scan, weights)[order]
    measured = np.where(scale > 0.0, scan.brdf[order], 0.0)
    return Problem(
        model=model,
        features=features[order],
        starts=np.append(0, np.cumsum(np.bincount(group))).astype(np.uint32),
        target=np.ascontiguousarray((scale * measured).T),
        scale=np.ascontiguousarray(scale.T),
        lower=limits[:, 0],
        upper=limits[:, 1],
        keys=scan.column_keys,
        device=device,
    )

"""What every fitting method gets: plain arrays, the same for all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.fit.layout import Layout, layout_of
from clbrdf.fit.sample import DirectionSample
from clbrdf.models import Model
from clbrdf.objective import scale_residuals
from clbrdf.observation import ForwardModel, Observation
from clbrdf.opencl.device import Device
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

BLOCK = 1 << 14
"""Directions up to which a matrix is put in order as a whole."""


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
    sample : DirectionSample or None
        Directions on which many are searched, where they are chosen already.
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
    sample: DirectionSample | None = None

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
    layout: Layout | None = None,
    places: npt.NDArray[np.intp] | None = None,
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
    layout : Layout, optional
        Of the scan's directions, where it is known from another block of wavelengths.
    places : (B,) int, optional
        Of the wavelengths of the problem; all if not given.
    """
    wanted = np.arange(len(scan.wavelength)) if places is None else places
    known = {name: values[wanted] for name, values in (given or {}).items()}
    limits = np.repeat(model.coordinate_bounds(bounds)[None], len(wanted), axis=0)
    for j, row in enumerate(model.parameters):
        if row.name in known:
            limits[:, j] = row.to_coordinate(known[row.name])[:, None]
    at = layout or layout_of(model, scan.directions, observation)
    target, scale = columns_of((scan.brdf, weights), at.order, wanted)
    scale_residuals(target, scale)
    return Problem(
        model=model,
        features=at.features,
        seen=at.seen,
        starts=at.starts,
        target=target,
        scale=scale,
        lower=np.ascontiguousarray(limits[..., 0]),
        upper=np.ascontiguousarray(limits[..., 1]),
        free=tuple(j for j, row in enumerate(model.parameters) if row.name not in known),
        mirror=at.mirror,
        keys=scan.column_keys[wanted],
        device=device,
        order=at.order,
        sample=at.sample,
    )


def columns_of(
    matrices: Sequence[npt.NDArray[np.generic]], order: npt.NDArray[np.intp], places: npt.NDArray[np.intp]
) -> list[Any]:
    """Return columns of matrices (N, W) as rows (B, N) of fp64, directions in an order."""
    out = [np.empty((len(places), len(order))) for _ in matrices]
    if len(order) > BLOCK:  # column by column: the rows of a part are more than the cache holds
        for values, matrix in zip(out, matrices, strict=True):
            for row, place in zip(values, places, strict=True):
                row[:] = np.take(matrix[:, place], order)
        return out
    first, last = int(places[0]), int(places[-1]) + 1
    columns = slice(first, last) if last - first == len(places) else places
    for values, matrix in zip(out, matrices, strict=True):
        values[:] = matrix[:, columns][order].T
    return out

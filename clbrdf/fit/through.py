"""Fitting through the instrument: what the detector sees, with as many nodes as the data need.

A fit of points is the start. There each direction takes the smallest order of its cones whose change to the
next is far below the noise at every wavelength; all wavelengths share the nodes. The parameters are
polished on these nodes, and at the optimum the next order tells how far they would still move,

    δp = (JᵀGJ)⁻¹ JᵀG Δ,

Δ the change of the values. Where that is more than a share of their standard uncertainties, values may change
by a quarter as much as before, orders rise, and the polish begins again from where it is.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice
from clbrdf.fit.normal_equations import CHUNK_BYTES
from clbrdf.fit.shared import inverse_of
from clbrdf.fit.slit import slit_matrix
from clbrdf.fit.solve import Solution
from clbrdf.geometry import Directions
from clbrdf.instrument.rules import CONES, LADDER
from clbrdf.models import Model
from clbrdf.observation import ForwardModel, Observation
from clbrdf.records import Record
from clbrdf.scan import Scan

if TYPE_CHECKING:
    from clbrdf.instrument.settings import Instrument

Array = npt.NDArray[np.float64]
Levels = npt.NDArray[np.uint8]

SCAN, POINT = "scan", "point"
"""What a fit may be told in place of an instrument: to take what the scan says of its own, or points."""

CHANGE = 0.02
"""Of a value's standard uncertainty, by which the next order may change it. With 0.05 the polish is nearly
always done twice."""

SHIFT = 0.05
"""Of a parameter's standard uncertainty, by which the next orders may move it. What is wanted is a bias
below a tenth; a step of orders tells the error of the lower one to a factor of about two."""

MOST_RAISES = 3
TIGHTER = 0.25
"""What a raise makes of CHANGE. Small errors of the same sign in all directions add up in a parameter."""

LEAST_NOISE = 1e-6
"""Of a value: no data are taken for better."""

MOST_VALUES = 1 << 21
"""At nodes, of one pass over some of the directions: 16 MiB of each array."""


@dataclass(frozen=True, eq=False)
class Through(Record):
    """What a fit takes for the instrument behind its N directions.

    Attributes
    ----------
    instrument : Instrument
    source : str
        Who says so: a file's name, "the scan file", or "the call".
    angle : (N,) float64 or None
        Full angle of the aperture's cone, degrees; 0 where it is not known and a point is taken.
    levels : (N, 2) uint8
        Places in LADDER (`clbrdf.instrument.place`) of the rules for beam and aperture.
    """

    instrument: Instrument
    source: str
    angle: Array | None
    levels: Levels

    @property
    def cones(self) -> tuple[int, ...]:
        """Columns of `levels` whose cones are there."""
        there = {"beam": self.instrument.beam is not None, "aperture": self.angle is not None}
        return tuple(k for k, name in enumerate(CONES) if there[name])

    def observation(self, directions: Directions) -> Observation:
        """Return what is seen in the N directions."""
        from clbrdf.instrument.place import observation_of

        return observation_of(self.instrument, self.angle, directions, self.levels)

    def slit(self, wavelength: Array) -> Array | None:
        """Return what each of the fitted wavelengths (K,) is seen as, (K, K); None for itself alone."""
        band = self.instrument.bandwidth
        return None if band is None else slit_matrix(band, wavelength)

    def elsewhere(self, where: Scan | Directions) -> Through:
        """Return the same for other directions, all with the highest of these levels.

        An aperture that the scan told of is that of the other scan, or for bare directions the median one.
        """
        angle, n = None, len(where)
        if self.instrument.aperture is not None:
            angle = np.full(n, self.instrument.aperture.angle)
        elif self.angle is not None:
            known = self.angle[self.angle > 0.0]
            angle = own_angle(where) if isinstance(where, Scan) else np.full(n, np.median(known))
        return replace(self, angle=angle, levels=np.tile(self.levels.max(axis=0), (n, 1)))

    def part(self, places: npt.NDArray[np.intp] | npt.NDArray[np.bool_], levels: Levels) -> Through:
        """Return the same for some of the directions, with other levels."""
        return replace(self, angle=None if self.angle is None else self.angle[places], levels=levels)


def instrument_behind(scan: Scan, told: str | Path | Instrument, smooth: bool) -> Through | None:
    """Return the instrument that a fit, smooth or not, is told to look through; None for points.

    What the scan says of its bandpass is taken by smooth fits, where it is not finer than the wavelengths.

    Raises
    ------
    InputError
        A file that is missing or names no geometry; a cone that reaches below the horizon; a bandwidth for a
        fit that is not smooth, or one that is finer than the wavelengths.
    """
    if isinstance(told, str) and told == POINT:
        return None
    by_scan = isinstance(told, str) and told == SCAN
    if by_scan and scan.solid_angle is None and not scan.effects and (scan.bandpass is None or not smooth):
        return None
    # Settings are classes of a library that loads slowly, and most fits need none.
    from clbrdf.instrument.bandwidth import Bandwidth
    from clbrdf.instrument.place import check_horizon
    from clbrdf.instrument.settings import Instrument, load_instrument
    from clbrdf.storage.tomlfile import parse_json

    n, angle = len(scan), None
    if by_scan:
        source, angle = "the scan file", own_angle(scan)
        instrument = parse_json(json.dumps({k: dict(v) for k, v in scan.effects.items()}), Instrument, source)
        band = scan.bandpass
        apart = np.diff(scan.wavelength).max(initial=0.0)
        if smooth and band is not None and np.ptp(band) == 0.0 and band[0] >= apart > 0.0:
            instrument = instrument.model_copy(update={"bandwidth": Bandwidth(width=float(band[0]))})
        if angle is None and not instrument.on():
            return None
    elif isinstance(told, Instrument):
        instrument, source = told, "the call"
        if not told.on():
            return None
    else:
        instrument, source = load_instrument(told), Path(told).name
    if instrument.aperture is not None:
        angle = np.full(n, instrument.aperture.angle)
    if instrument.bandwidth is not None:
        check_bandwidth(instrument, source, smooth)
        slit_matrix(instrument.bandwidth, scan.wavelength)
    check_horizon(instrument, angle, scan.directions, source)
    return Through(instrument, source, angle, np.zeros((n, len(CONES)), dtype=np.uint8))


def check_bandwidth(instrument: Instrument, source: str, smooth: bool) -> None:
    """Raise InputError where a fit that is not smooth is told of a bandwidth."""
    if instrument.bandwidth is not None and not smooth:
        raise InputError(
            f"{source}: bandwidth ties neighbouring wavelengths; add"
            f" {advice('smooth=0.01', '--smooth 0.01')}, or leave bandwidth out"
        )


def own_angle(scan: Scan) -> Array | None:
    """Return the full angle (N,) of the cone that a scan's receiver takes, degrees; 0 where it is not known.

    None where it is known nowhere.
    """
    solid = scan.solid_angle
    if solid is None or not np.isfinite(solid).any():
        return None
    from clbrdf.instrument.aperture import cone_angle

    return np.asarray(cone_angle(np.where(np.isfinite(solid), solid, 0.0)))


Polish = Callable[[Observation, Solution], Solution]


def look_through(
    scan: Scan,
    model: Model,
    weights: Array,
    fitted: npt.NDArray[np.intp],
    through: Through,
    solution: Solution,
    free: tuple[int, ...],
    limits: tuple[Array, Array],
    polish: Polish,
) -> tuple[Solution, Through]:
    """Return the solution behind an instrument, and the instrument with the orders that were needed.

    Parameters
    ----------
    scan : Scan
        N directions.
    model : Model
    weights : (N, W) float64
    fitted : (K,) int
        Places of the wavelengths of the solution.
    through : Through
    solution : Solution
        Of points.
    free : tuple of int
        Places of the parameters that are fitted.
    limits : pair of (K, P) float64
        Of the coordinates.
    polish : callable
        From an observation and a solution to the solution there.
    """
    search = _Orders(scan, model, weights[:, fitted], scan.columns(fitted))
    for raised in range(MOST_RAISES + 1):
        parameters = model.from_coordinates(solution.coordinates)
        through, change = search.enough(through, parameters, CHANGE * TIGHTER**raised)
        observation = through.observation(scan.directions)
        if not observation.is_points:
            solution = polish(observation, solution)
        elif np.sqrt(len(scan)) * change <= SHIFT:
            break  # as far as values that change so little can move a parameter together
        if (
            raised == MOST_RAISES
            or not through.cones
            or not search.moved(through, observation, solution, free, limits)
        ):
            break
    return solution, through


class _Orders:
    """Which orders the values of a scan need, at parameters that change."""

    def __init__(self, scan: Scan, model: Model, weights: Array, columns: Scan) -> None:
        self.directions, self.model = scan.directions, model
        self.weights, self.used = weights.T, weights.T > 0.0
        self.measured = np.where(self.used, columns.brdf.T, 0.0)
        self.sigma = None if columns.sigma is None else columns.sigma.T

    def enough(self, through: Through, parameters: Array, change: float) -> tuple[Through, float]:
        """Return the instrument with orders so high that the next change no value by a share of its noise.

        With it comes the largest such share; infinite where there is no next order.
        """
        levels = through.levels.copy()
        every = np.arange(len(self.directions))
        values = self.values(through, every, levels, parameters)
        noise = self.noise(values, parameters)
        left = np.full((len(every), len(CONES)), np.inf)
        left[:, [k for k in range(len(CONES)) if k not in through.cones]] = 0.0
        for cone in through.cones:
            active = np.flatnonzero(self.used.any(axis=0) & (levels[:, cone] < len(LADDER) - 1))
            while active.size:
                finer = levels[active]
                finer[:, cone] += 1
                new = self.values(through, active, finer, parameters)
                away = np.abs(new - values[:, active])
                with np.errstate(divide="ignore", invalid="ignore"):
                    share = np.where(self.used[:, active] & (away > 0.0), away / noise[:, active], 0.0)
                left[active, cone] = share.max(axis=0)
                rises = ~(left[active, cone] <= change)
                left[active[rises], cone] = np.inf
                values[:, active] = np.where(rises, new, values[:, active])
                active = active[rises]
                levels[active, cone] += 1
                active = active[levels[active, cone] < len(LADDER) - 1]
        measured = self.used.any(axis=0)
        return replace(through, levels=levels), float(left[measured].sum(axis=1).max(initial=0.0))

    def moved(
        self,
        through: Through,
        observation: Observation,
        solution: Solution,
        free: tuple[int, ...],
        limits: tuple[Array, Array],
    ) -> bool:
        """Whether the next orders would move a parameter by more than a share of its uncertainty."""
        q, model = solution.coordinates, self.model
        parameters = model.from_coordinates(q)
        every, columns = np.arange(len(self.directions)), list(through.cones)
        finer = through.levels.copy()
        finer[:, columns] = np.minimum(finer[:, columns] + 1, len(LADDER) - 1)
        seen = ForwardModel.of(model, observation)
        values = seen.brdf(parameters[:, None, :])
        change = self.values(through, every, finer, parameters) - values
        noise = self.noise(values, parameters)
        slopes = np.stack([row.slope(parameters[:, j]) for j, row in enumerate(model.parameters)], axis=1)
        places = list(free)
        inside = ((q > limits[0]) & (q < limits[1]))[:, places]
        size = max(1, CHUNK_BYTES // (8 * q.shape[1] * len(seen.features)))
        for first in range(0, len(q), size):
            rows = slice(first, first + size)
            root = np.sqrt(self.weights[rows] / self.weights[rows].max(axis=1, keepdims=True))
            jacobian = seen.jacobian(parameters[rows, None, :])[..., places]
            jacobian *= root[..., None] * slopes[rows][:, None, places]
            jacobian[~self.used[rows]] = 0.0
            across = np.swapaxes(jacobian, 1, 2)
            solve = inverse_of(across @ jacobian, inside[rows]) @ across
            usable = np.where(self.used[rows], root * change[rows], 0.0)
            shift = np.abs((solve @ usable[..., None])[..., 0])
            sigma = np.sqrt(((solve * (root * noise[rows])[:, None, :]) ** 2).sum(axis=2))
            if (shift > SHIFT * sigma).any():
                return True
        return False

    def noise(self, values: Array, parameters: Array) -> Array:
        """Return the standard uncertainty (W, N) of each value: the scan's, else that of the residuals."""
        count = self.used.sum(axis=1) - parameters.shape[1]
        residual = np.where(self.used, values - self.measured, 0.0)
        level = np.sqrt((self.weights * residual**2).sum(axis=1) / np.maximum(count, 1))
        with np.errstate(divide="ignore"):
            out = level[:, None] / np.sqrt(self.weights)
        if self.sigma is not None:
            known = np.isfinite(self.sigma) & (self.sigma > 0.0)
            out = np.where(known, self.sigma, out)
        return np.asarray(np.maximum(np.where(self.used, out, 0.0), LEAST_NOISE * np.abs(values)))

    def values(
        self, through: Through, places: npt.NDArray[np.intp], levels: Levels, parameters: Array
    ) -> Array:
        """Return what is seen (W, n) in some directions with levels (n, 2) of their own."""
        out = np.empty((len(parameters), len(places)))
        nodes = np.array([rule.count for rule in LADDER])[levels].prod(axis=1)
        part = (np.cumsum(nodes) * len(parameters)) // MOST_VALUES
        first = 0
        for last in [*(np.flatnonzero(np.diff(part)) + 1).tolist(), len(places)]:
            some = places[first:last]
            observation = through.part(some, levels[first:last]).observation(self.directions[some])
            out[:, first:last] = ForwardModel.of(self.model, observation).brdf(parameters[:, None, :])
            first = last
        return out


def check_through(told: object) -> None:
    """Raise InputError where what is told is neither a word, a path nor an instrument."""
    if isinstance(told, str | Path):
        return
    from clbrdf.instrument.settings import Instrument

    if not isinstance(told, Instrument):
        raise InputError(
            f"through is {told!r}; give an instrument file, an Instrument, {SCAN!r} for what the scan"
            f" says, or {POINT!r}"
        )

"""Angular zeros and tilt of the sample from the specular peak and the direct beam.

An axis that reads x stands at x + e. Three peaks give the three errors e:

    direct beam   the lamp's peak lies where it stands opposite to the detector:  e_α = 180° − α
    specular      the sample's normal halves the angle between lamp and detector:
                  e_β = (α + e_α)/2 − β,     e_γ = −γ

A tilt of the sample in its holder turns its normal as an error of turn and pitch does, so e_β and e_γ are
the sums of both, which is what a scan needs: the specular direction where the plan puts it.

For a reciprocal surface the radiance seen while the sample turns past the mirror position is an even
function about it, because θi and θr change places; the signal is divided by cosθr for that. It is even in
the pitch as well. So a peak's centre is that of an even function of as many terms as it takes, fitted over
a range that is symmetric about it; no shape of lobe is assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt

from clbrdf.errors import advice
from clbrdf.rig.errors import UnmendedError

Array = npt.NDArray[np.float64]
Reading = tuple[float, float, float]
"""An angle read back, a signal and its standard uncertainty."""

Measure = Callable[[tuple[float, float, float]], tuple[tuple[float, ...], float, float]]
"""From rig angles (lamp, turn, pitch) to those read back, a signal and its standard uncertainty."""

USED = 0.35
"""Share of its height down to which a peak is fitted."""

FINE_POINTS = 21
LEAST_SIGMAS = 8.0
"""A peak stands out of what is around it by at least this many standard deviations."""

GOOD_CHI2 = 2.0
"""Reduced χ² that a curve through a peak is allowed to have."""

MOST_ORDERS = 6
ANYWHERE = ((-np.inf, np.inf),) * 3
POSITION_SIGMA = 2e-4
"""How well one position is known, degrees: half a count of a common rotary stage."""


@dataclass(frozen=True)
class PeakCentre:
    """A value and its standard uncertainty, degrees."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Alignment:
    """Errors of the axes: each stands at what it reads plus its error, tilt of the sample included.

    Attributes
    ----------
    lamp, turn, pitch : PeakCentre
        Degrees.
    chi2 : float
        Reduced, of the turn's peaks about their common error; NaN with a single lamp angle.
    """

    lamp: PeakCentre
    turn: PeakCentre
    pitch: PeakCentre
    chi2: float


def align(
    measure: Measure,
    direct: Sequence[float],
    lamps: Sequence[float] = (50.0, 80.0, 110.0),
    reach: float = 3.0,
    step: float = 0.25,
    position: float = POSITION_SIGMA,
    limits: Sequence[tuple[float, float]] = ANYWHERE,
) -> Alignment:
    """Find the errors of the axes with a glossy sample, or a mirror, in the holder.

    Parameters
    ----------
    measure : callable
        Measures the signal at a pose.
    direct : (float, float, float)
        Pose of the direct beam, degrees, the lamp at ±180.
    lamps : sequence of float
        Lamp angles at which the specular peak is looked for, degrees.
    reach, step : float
        How far from its nominal place, and how finely, a peak is looked for, degrees.

    Raises
    ------
    UnmendedError
        No peak stands out within reach.
    """
    error = np.zeros(3)

    def peak(axis: int, pose: Sequence[float], cosine: bool, nominal: float, what: str) -> PeakCentre:
        return find_peak(along(axis, pose, cosine), nominal, reach, step, what, position, limits[axis])

    def along(axis: int, pose: Sequence[float], cosine: bool) -> Callable[[float], Reading]:
        def one(angle: float) -> Reading:
            place = list(pose)
            place[axis] = angle
            read, value, sigma = measure((place[0], place[1], place[2]))
            turn, pitch = np.deg2rad(np.array(read[1:]) + error[1:])
            factor = float(np.cos(turn) * np.cos(pitch)) if cosine else 1.0
            return read[axis], value / factor, sigma / factor

        return one

    lamp_peak = peak(0, direct, False, direct[0], "the direct beam, lamp")
    lamp = PeakCentre(float(np.copysign(180.0, direct[0])) - lamp_peak.value, lamp_peak.sigma)
    error[0] = lamp.value
    turns, pitches = [], []
    # The first peak is looked for twice: cosθr needs the errors that are looked for.
    for place, angle in enumerate((lamps[0], *lamps)):
        what = f"the specular peak at lamp {angle:g}°,"
        nominal = (angle + error[0]) / 2.0 - error[1]
        if place == 0:
            # Coarsely first in both, because a peak may lie beside the plane.
            error[2] = -_coarse(along, angle, nominal, reach, step, what)
        pose = (angle, nominal, -error[2])
        turn = peak(1, pose, True, nominal, f"{what} turn")
        pose = (angle, turn.value, -error[2])
        pitch = peak(2, pose, True, -error[2], f"{what} pitch")
        error[1], error[2] = (angle + error[0]) / 2.0 - turn.value, -pitch.value
        if place:
            turns.append(PeakCentre(angle / 2.0 - turn.value, turn.sigma))
            pitches.append(PeakCentre(-pitch.value, pitch.sigma))
    mean, chi2 = _mean(turns)
    turn = PeakCentre(mean.value + lamp.value / 2.0, float(np.hypot(mean.sigma, lamp.sigma / 2.0)))
    return Alignment(lamp, turn, _mean(pitches)[0], chi2)


def _coarse(
    along: Callable[..., Callable[[float], Reading]],
    lamp: float,
    turn: float,
    reach: float,
    step: float,
    what: str,
) -> float:
    """Return the pitch near which the specular peak lies: a cross, then a lattice where that sees nothing."""
    offsets = _offsets(reach, step)
    best, place, floor, sigma = -np.inf, 0.0, np.inf, 0.0
    for pitch in sorted(_offsets(reach, 2.0 * step), key=abs):
        for offset in offsets[::2]:
            read, value, noise = along(1, (lamp, turn, pitch), True)(turn + offset)
            del read
            floor = min(floor, value)
            if value > best:
                best, place, sigma = value, float(pitch), noise
        if best - floor > 0.5 * best and best - floor > LEAST_SIGMAS * sigma and abs(pitch) > abs(place):
            return place
    if not best - floor > LEAST_SIGMAS * sigma:
        raise UnmendedError(_nothing(what, reach))
    return place


def find_peak(
    one: Callable[[float], Reading],
    nominal: float,
    reach: float,
    step: float,
    what: str,
    position: float = POSITION_SIGMA,
    limits: tuple[float, float] = (-np.inf, np.inf),
) -> PeakCentre:
    """Find the centre of a peak along one axis, degrees.

    Parameters
    ----------
    one : callable
        From an angle to the angle read back, a signal and its standard uncertainty.
    nominal, reach, step : float
        Where to look, degrees.
    what : str
        For the message where there is none.
    position : float
        Standard uncertainty of one position, degrees.
    limits : (float, float)
        How far the axis may go, degrees.

    Raises
    ------
    UnmendedError
        No peak stands out within reach, or it lies at its edge.
    """
    low, high = limits
    coarse = np.array([one(angle) for angle in nominal + _offsets(reach, step) if low <= angle <= high])
    angles, values, sigmas = coarse.T
    top = int(np.argmax(values))
    floor = float(np.min(values))
    if not values[top] - floor > LEAST_SIGMAS * sigmas[top]:
        raise UnmendedError(_nothing(what, reach))
    level = floor + USED * (values[top] - floor)
    inside = np.nonzero(values >= level)[0]
    width = max(step, float(angles[inside[-1]] - angles[inside[0]]) / 2.0)
    width = min(width, reach)
    centre = float(np.average(angles[inside], weights=values[inside] - floor))
    if abs(centre - nominal) > reach - step:
        raise UnmendedError(_nothing(what, reach))
    estimate = PeakCentre(centre, step)
    for _ in range(2):
        # Symmetric about the centre, also where a limit is near.
        room = min(width, high - estimate.value, estimate.value - low)
        fine = np.array([one(estimate.value + x) for x in np.linspace(-room, room, FINE_POINTS)])
        estimate = fit_centre(fine[:, 0], fine[:, 1], fine[:, 2], estimate.value, position)
    return estimate


def _nothing(what: str, reach: float) -> str:
    return (
        f"{what}: no peak stands out within {reach:g}°; put in a glossy sample or a mirror, look farther"
        f" ({advice('reach', '--reach')}) or more finely ({advice('step', '--step')})"
    )


def _offsets(reach: float, step: float) -> Array:
    count = int(np.ceil(reach / step))
    return np.asarray(np.arange(-count, count + 1) * step, dtype=np.float64)


def fit_centre(angles: Array, values: Array, sigmas: Array, start: float, position: float) -> PeakCentre:
    """Return the centre c of an even function, ln S = Σ_k a_k (x − c)^2k, weighted by what is uncertain.

    The order is the lowest whose χ² is no longer large; where none is, the uncertainty of the centre is
    widened. `position` is the standard uncertainty of each angle, degrees; it enters through the slope.
    """
    from scipy.optimize import least_squares

    good = values > 3.0 * sigmas
    x, logs, relative = angles[good] - start, np.log(values[good]), sigmas[good] / values[good]
    span = float(np.ptp(x)) / 2.0 or 1.0
    estimate, excess = PeakCentre(start, span), np.inf
    for order in range(2, MOST_ORDERS + 1):
        powers = np.arange(order + 1, dtype=np.float64)
        noise, guess = relative, np.zeros(order + 2)
        guess[1] = float(logs.max())
        for _ in range(3):

            def residuals(p: Array, noise: Array = noise, powers: Array = powers) -> Array:
                model = (((x / span - p[0]) ** 2)[:, None] ** powers) @ p[1:]
                return cast(Array, (logs - model) / noise)

            found = least_squares(residuals, guess, method="lm")
            guess = np.asarray(found.x)
            u = (x / span - guess[0])[:, None]
            slope = ((2.0 * powers[1:] * u ** (2 * powers[1:] - 1)) @ guess[2:]) / span
            noise = np.hypot(relative, position * slope)
        freedom = len(x) - len(guess)
        if freedom < 3:
            break
        jacobian = np.asarray(found.jac, dtype=np.float64)
        covariance = np.linalg.pinv(jacobian.T @ jacobian)
        excess = float(2.0 * found.cost) / freedom
        widening = np.sqrt(excess) if excess > GOOD_CHI2 else 1.0
        estimate = PeakCentre(
            start + span * float(guess[0]), span * float(np.sqrt(covariance[0, 0])) * widening
        )
        if excess < GOOD_CHI2:
            break
    return estimate


def _mean(estimates: Sequence[PeakCentre]) -> tuple[PeakCentre, float]:
    """Return the weighted mean and the reduced χ²; a scatter beyond the uncertainties widens them."""
    values = np.array([estimate.value for estimate in estimates])
    weights = np.array([estimate.sigma for estimate in estimates]) ** -2.0
    mean = float((values * weights).sum() / weights.sum())
    sigma = float(weights.sum() ** -0.5)
    if len(values) < 2:
        return PeakCentre(mean, sigma), float("nan")
    chi2 = float((weights * (values - mean) ** 2).sum() / (len(values) - 1))
    return PeakCentre(mean, sigma * float(np.sqrt(max(1.0, chi2) if chi2 > 3.0 else 1.0))), chi2

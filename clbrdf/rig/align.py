"""Angular zeros and tilt of the sample from the specular peak and the direct beam.

An axis that reads x stands at x + e. Three peaks give the three errors e:

    direct beam   the lamp's peak lies where it stands opposite to the detector:  e_α = 180° − α
    specular      the sample's normal halves the angle between lamp and detector:
                  e_β = (α + e_α)/2 − β,     e_γ = −γ

A tilt of the sample in its holder turns its normal as an error of turn and pitch does, so e_β and e_γ are
the sums of both, which is what a scan needs: the specular direction where the plan puts it.

For a reciprocal surface the radiance seen while the sample turns past the mirror position is an even
function about it, because θi and θr change places; the signal is divided by cosθr for that. It is even in
the pitch as well. So a peak's centre is that of an even function, ln S = a − b (x − c)² + d (x − c)⁴,
fitted over a range that is symmetric about it; no shape of lobe is assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.rig.errors import UnmendedError

Array = npt.NDArray[np.float64]
Measure = Callable[[tuple[float, float, float]], tuple[tuple[float, ...], float, float]]
"""From rig angles (lamp, turn, pitch) to those read back, a signal and its standard uncertainty."""

USED = 0.35
"""Share of its height down to which a peak is fitted."""

FINE_POINTS = 15
LEAST_SIGMAS = 8.0
"""A peak stands out of what is around it by at least this many standard deviations."""

POSITION_SIGMA = 2e-4
"""How well one position is known, degrees: half a count of a common rotary stage."""


@dataclass(frozen=True)
class Estimate:
    """A value and its standard uncertainty, degrees."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Alignment:
    """Errors of the axes: each stands at what it reads plus its error, tilt of the sample included.

    Attributes
    ----------
    lamp, turn, pitch : Estimate
        Degrees.
    chi2 : float
        Reduced, of the turn's peaks about their common error; NaN with a single lamp angle.
    """

    lamp: Estimate
    turn: Estimate
    pitch: Estimate
    chi2: float


def align(
    measure: Measure,
    direct: Sequence[float],
    lamps: Sequence[float] = (50.0, 80.0, 110.0),
    reach: float = 3.0,
    step: float = 0.25,
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

    def along(
        axis: int, pose: Sequence[float], cosine: bool
    ) -> Callable[[float], tuple[float, float, float]]:
        def one(angle: float) -> tuple[float, float, float]:
            place = list(pose)
            place[axis] = angle
            read, value, sigma = measure((place[0], place[1], place[2]))
            factor = np.cos(np.deg2rad(read[1])) * np.cos(np.deg2rad(read[2])) if cosine else 1.0
            return read[axis], value / factor, sigma / factor

        return one

    lamp_peak = find_peak(along(0, direct, False), direct[0], reach, step, "the direct beam, lamp")
    lamp = Estimate(float(np.copysign(180.0, direct[0])) - lamp_peak.value, lamp_peak.sigma)
    turns, pitches = [], []
    turn_at, pitch_at = 0.0, 0.0
    for angle in lamps:
        what = f"the specular peak at lamp {angle:g}°,"
        # Coarsely first in both, because a peak may lie beside the plane.
        nominal = angle / 2.0 + turn_at
        if not turns:
            pitch_at = _coarse(along, angle, nominal, reach, step, what)
        pose = (angle, nominal, pitch_at)
        turn = find_peak(along(1, pose, True), nominal, reach, step, f"{what} turn")
        pose = (angle, turn.value, pitch_at)
        pitch = find_peak(along(2, pose, True), pitch_at, reach, step, f"{what} pitch")
        turn_at, pitch_at = turn.value - angle / 2.0, pitch.value
        turns.append(Estimate(angle / 2.0 - turn.value, turn.sigma))
        pitches.append(Estimate(-pitch.value, pitch.sigma))
    mean, chi2 = _mean(turns)
    turn = Estimate(mean.value + lamp.value / 2.0, float(np.hypot(mean.sigma, lamp.sigma / 2.0)))
    return Alignment(lamp, turn, _mean(pitches)[0], chi2)


def _coarse(
    along: Callable[..., Callable[[float], tuple[float, float, float]]],
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
    one: Callable[[float], tuple[float, float, float]], nominal: float, reach: float, step: float, what: str
) -> Estimate:
    """Find the centre of a peak along one axis, degrees.

    Parameters
    ----------
    one : callable
        From an angle to the angle read back, a signal and its standard uncertainty.
    nominal, reach, step : float
        Where to look, degrees.
    what : str
        For the message where there is none.

    Raises
    ------
    UnmendedError
        No peak stands out within reach, or it lies at its edge.
    """
    coarse = np.array([one(nominal + offset) for offset in _offsets(reach, step)])
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
    estimate = Estimate(centre, step)
    for _ in range(2):
        fine = np.array([one(estimate.value + x) for x in np.linspace(-width, width, FINE_POINTS)])
        estimate = fit_centre(*fine.T, estimate.value)
    return estimate


def _nothing(what: str, reach: float) -> str:
    return (
        f"{what}: no peak stands out within {reach:g}°; put in a glossy sample or a mirror, look farther"
        " (--reach) or more finely (--step)"
    )


def _offsets(reach: float, step: float) -> Array:
    count = int(np.ceil(reach / step))
    return np.arange(-count, count + 1) * step


def fit_centre(angles: Array, values: Array, sigmas: Array, start: float) -> Estimate:
    """Return the centre of ln S = a − b (x − c)² + d (x − c)⁴, weighted by the signal's uncertainty.

    The uncertainty of the positions enters through the slope. Where the scatter about the curve is larger
    than what was stated, so is the uncertainty of the centre.
    """
    from scipy.optimize import least_squares

    good = values > 3.0 * sigmas
    x, logs, relative = angles[good], np.log(values[good]), sigmas[good] / values[good]
    span = float(np.ptp(x)) / 2.0 or 1.0
    guess = np.polyfit((x - start) / span, logs, 2, w=1.0 / relative)

    def curve(p: Array) -> Array:
        t = ((x - start) / span - p[1]) ** 2
        return np.asarray(p[0] - p[2] * t + p[3] * t**2)

    def slope(p: Array) -> Array:
        u = (x - start) / span - p[1]
        return np.asarray((-2.0 * p[2] * u + 4.0 * p[3] * u**3) / span)

    first = np.array([logs.max(), 0.0, max(-float(guess[0]), 1e-3), 0.0])
    noise = relative
    for _ in range(2):
        found = least_squares(lambda p, noise=noise: (logs - curve(p)) / noise, first)
        first = found.x
        noise = np.hypot(relative, POSITION_SIGMA * slope(first))
    freedom = max(1, len(x) - 4)
    excess = max(1.0, float(2.0 * found.cost) / freedom)
    covariance = np.linalg.pinv(found.jac.T @ found.jac)
    sigma = span * float(np.sqrt(covariance[1, 1] * (excess if excess > 2.5 else 1.0)))
    return Estimate(start + span * float(found.x[1]), sigma)


def _mean(estimates: Sequence[Estimate]) -> tuple[Estimate, float]:
    """Return the weighted mean and the reduced χ²; a scatter beyond the uncertainties widens them."""
    values = np.array([estimate.value for estimate in estimates])
    weights = np.array([estimate.sigma for estimate in estimates]) ** -2.0
    mean = float((values * weights).sum() / weights.sum())
    sigma = float(weights.sum() ** -0.5)
    if len(values) < 2:
        return Estimate(mean, sigma), float("nan")
    chi2 = float((weights * (values - mean) ** 2).sum() / (len(values) - 1))
    return Estimate(mean, sigma * float(np.sqrt(max(1.0, chi2) if chi2 > 3.0 else 1.0))), chi2

"""From a plan to a route: what can be reached, in which order, and how long it takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.rig.kinematics import inverse
from clbrdf.rig.planfile import Plan
from clbrdf.rig.rigfile import Rig
from clbrdf.rig.stagesettings import AXES, StageSettings
from clbrdf.rig.zones import is_inside
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

STAGE_EXCHANGES, REFERENCE_EXCHANGES, SPECTRUM_BYTES = 28, 24, 2112
"""Exchanges of one point and bytes of one spectrum, for the estimate of time."""

BYTES_PER_EXCHANGE = 15
STAGE_REPLY, REFERENCE_REPLY = 0.01, 0.05
"""Typical time to a reply, s."""

MOST_AT_ONCE = 4000
"""Points among which the next one is looked for."""

TYPICAL_INTEGRATION = 0.1
"""Stands for an automatic integration time in the estimate, s."""


@dataclass(frozen=True, eq=False)
class Route:
    """The points of a measurement in the order in which they are taken.

    Attributes
    ----------
    directions : Directions
        N points, repeats included.
    axes : (N, 3) float64
        Rig angles lamp, turn, pitch, degrees, rounded to what travels on the line.
    planned : int
        Points of the plan, repeats included.
    unreachable : mapping of str to int
        How many of them were left out, by reason.
    seconds : float
        Estimated duration.
    """

    directions: Directions
    axes: Array
    planned: int
    unreachable: dict[str, int]
    seconds: float

    def __len__(self) -> int:
        return len(self.axes)


def plan_route(plan: Plan, rig: Rig) -> Route:
    """Find the reachable points, order them, and estimate the time.

    Raises
    ------
    InputError
        None of the plan's points can be reached.
    """
    directions = plan.directions()
    candidates, reasons = reachable(directions, rig)
    usable = ~np.isnan(candidates[..., 0]).all(axis=1)
    unreachable = {
        reason: int(np.count_nonzero(reasons == reason)) * plan.repeats
        for reason in dict.fromkeys(reasons.tolist())
        if reason
    }
    if not usable.any():
        raise InputError(
            f"none of the {len(directions)} directions can be reached: "
            + ", ".join(f"{count} {reason}" for reason, count in unreachable.items())
        )
    speeds = [getattr(rig.stages, name) for name in AXES]
    places = np.nonzero(usable)[0]
    order, axes = order_points(candidates[places], speeds, plan.order)
    index = np.repeat(places[order], plan.repeats)
    axes = np.repeat(axes, plan.repeats, axis=0)
    return Route(
        directions[index],
        axes,
        len(directions) * plan.repeats,
        unreachable,
        _duration(axes, speeds, plan, rig),
    )


def panel_pose(rig: Rig) -> Array:
    """Return the rig angles (3,), degrees, at which the reference panel is measured.

    Raises
    ------
    InputError
        The axes cannot reach it.
    """
    panel = rig.geometry.panel
    assert panel is not None
    directions = Directions.relative(panel.theta_i, panel.theta_r, panel.phi)
    candidates, reasons = reachable(directions, rig)
    usable = candidates[0][~np.isnan(candidates[0, :, 0])]
    if not len(usable):
        raise InputError(f"geometry.panel cannot be measured at its angles: they are {reasons[0]}")
    return np.asarray(usable[0], dtype=np.float64)


def reachable(directions: Directions, rig: Rig) -> tuple[Array, npt.NDArray[np.str_]]:
    """Return solutions (N, 2, 3) with NaN for those out of reach, and the reason (N,), "" if one is left."""
    candidates = np.round(inverse(directions), 4)
    reasons = np.full(len(directions), "", dtype="U64")
    largest = rig.geometry.largest_zenith
    beyond = np.maximum(directions.theta_i, directions.theta_r) > largest
    reasons[beyond] = f"beyond the holder's rim at {largest:g}°"
    lamp = np.abs(candidates[:, 0, 0])
    shadow = ~beyond & ~(lamp >= rig.geometry.lamp_shadow)
    reasons[shadow] = f"behind the lamp, nearer than {rig.geometry.lamp_shadow:g}° to it"
    candidates[beyond | shadow] = np.nan
    outside = np.zeros(candidates.shape[:2], bool)
    for k, name in enumerate(AXES):
        low, high = getattr(rig.stages, name).limits
        with np.errstate(invalid="ignore"):
            out = (candidates[..., k] < low) | (candidates[..., k] > high)
        both = out.all(axis=1) & (reasons == "")
        reasons[both] = f"outside the limits of {name}"
        outside |= out
    candidates[outside] = np.nan
    reasons[_left_out(candidates, reasons)] = "outside the limits of two axes"
    with np.errstate(invalid="ignore"):
        candidates[is_inside(candidates, rig.stages.boxes)] = np.nan
    reasons[_left_out(candidates, reasons)] = "in a collision zone"
    return candidates, reasons


def _left_out(candidates: Array, reasons: npt.NDArray[np.str_]) -> npt.NDArray[np.bool_]:
    return np.asarray(np.isnan(candidates[..., 0]).all(axis=1) & (reasons == ""))


def order_points(
    candidates: Array, stages: list[StageSettings], order: str, start: Array | None = None
) -> tuple[npt.NDArray[np.intp], Array]:
    """Choose the order and, for each point, one of its solutions: always the nearest in travel time.

    A greedy tour from `start` (3,), degrees, the home position if not given; the time is that of the slowest
    axis. Its cost grows with the square of the number of points, so many are taken in portions of
    neighbouring lamp angles.
    """
    count = len(candidates)
    here = np.zeros(3) if start is None else start
    chosen, axes = np.empty(count, np.intp), np.empty((count, 3))
    places = np.arange(count)
    if order == "shortest" and count > MOST_AT_ONCE:
        places = np.argsort(np.nanmin(np.abs(candidates[..., 0]), axis=1), kind="stable")
    for first in range(0, count, MOST_AT_ONCE):
        left = places[first : first + MOST_AT_ONCE]
        for k in range(first, first + len(left)):
            pool = left[:1] if order == "given" else left
            times = travel_times(candidates[pool] - here, stages)
            times = np.where(np.isnan(times), np.inf, times)
            place, branch = np.unravel_index(np.argmin(times), times.shape)
            here = candidates[pool[place], branch]
            chosen[k], axes[k] = pool[place], here
            left = np.delete(left, place)
    return chosen, axes


def travel_times(distances: Array, stages: list[StageSettings]) -> Array:
    """Seconds of moves (..., 3), the slowest axis deciding."""
    times = []
    for k, stage in enumerate(stages):
        distance = np.abs(distances[..., k])
        ramp = stage.velocity**2 / stage.acceleration
        times.append(
            np.where(
                distance < ramp,
                2.0 * np.sqrt(distance / stage.acceleration),
                distance / stage.velocity + stage.velocity / stage.acceleration,
            )
        )
    return np.asarray(np.max(times, axis=0))


def _duration(axes: Array, stages: list[StageSettings], plan: Plan, rig: Rig) -> float:
    """Travel, exchanges, spectra, darks and references, s."""
    travel = float(travel_times(np.diff(axes, axis=0, prepend=np.zeros((1, 3))), stages).sum())
    integration = TYPICAL_INTEGRATION if plan.integration_time == "auto" else plan.integration_time
    spectrum = integration * plan.scans + _wire_time(rig.spectrometer, SPECTRUM_BYTES)
    longest = float(max(travel_times(np.full((1, 3), 90.0), stages)))
    homing = 3.0 * rig.stages.homing_time / 4.0
    points = homing + travel + len(axes) * (integration * plan.scans + overhead(rig))
    references = (len(axes) / plan.reference_every + 1.0) * (4.0 * spectrum + 2.0 * longest)
    darks = (points + references) / plan.dark_time
    if plan.dark_every is not None:
        darks = max(darks, len(axes) / plan.dark_every)
    return points + references + darks * (4.0 * spectrum + 2.0 * rig.spectrometer.shutter_time)


def overhead(rig: Rig) -> float:
    """Seconds that a point takes besides travel and exposure: exchanges, the spectrum's way, settling."""
    exchanges = STAGE_EXCHANGES * (STAGE_REPLY + _wire_time(rig.stages, BYTES_PER_EXCHANGE))
    exchanges += REFERENCE_EXCHANGES * (REFERENCE_REPLY + _wire_time(rig.reference, BYTES_PER_EXCHANGE))
    return exchanges + _wire_time(rig.spectrometer, SPECTRUM_BYTES) + rig.stages.settle


def _wire_time(section: TomlTable, count: int) -> float:
    """Seconds that bytes take on an instrument's line; 0 where it has no serial line."""
    baud = getattr(section, "baud", None)
    return count * 10.0 / baud if baud else 0.0

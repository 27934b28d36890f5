"""Directions and wavelengths as plan and scene files write them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, model_validator

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.storage.tomlfile import TomlTable

MOST_POINTS = 1_000_000


def spaced(start: float, stop: float, step: float) -> list[float]:
    """Return start, start + step, … up to and with `stop`.

    Raises
    ------
    ValueError
        A number that is not finite, a step that does not lead from start to stop, or too many values.
    """
    try:
        ends = float(start), float(stop), float(step)
        steps = (ends[1] - ends[0]) / ends[2]
    except (OverflowError, ZeroDivisionError):
        steps = np.nan
    if np.isfinite(steps) and steps < 0.0:
        raise ValueError(
            f"a range from {_plain(start)} to {_plain(stop)} is empty in steps of {_plain(step)};"
            f" take steps of {_plain(-step)}"
        )
    if not (np.isfinite(steps) and np.isfinite(ends).all()):
        said = f"a range from {_plain(start)} to {_plain(stop)} in steps of {_plain(step)} has no end"
        raise ValueError(f"{said}; start, stop and step are finite, and step leads from start to stop")
    if steps >= MOST_POINTS:
        raise ValueError(f"{steps:.6g} values; at most {MOST_POINTS}")
    count = int(np.floor(steps * (1.0 + 1e-12) + 1e-9)) + 1
    return [ends[0] + k * ends[2] for k in range(count)]


def _plain(value: float) -> str:
    """Return a number in short, also an integer that no float holds."""
    try:
        return f"{value:g}"
    except OverflowError:
        return f"a number of {len(str(abs(value)))} digits"


def _series(value: Any) -> Any:
    """Read a number, a list of numbers, or {start, stop, step} with both ends included."""
    if isinstance(value, Mapping):
        if set(value) != {"start", "stop", "step"}:
            raise ValueError("a range has the keys start, stop and step")
        start, stop, step = (value[key] for key in ("start", "stop", "step"))
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in (start, stop, step)):
            raise ValueError("start, stop and step are numbers")
        return spaced(start, stop, step)
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _inside(low: float, high: float, words: str) -> Any:
    def check(values: tuple[float, ...]) -> tuple[float, ...]:
        for value in values:
            if not low <= value < high:
                raise ValueError(f"{value:g}°; {words}")
        return values

    return check


Series = Annotated[tuple[float, ...], BeforeValidator(_series)]


class DirectionGrid(TomlTable):
    """All combinations of incident and view angles.

    Attributes
    ----------
    theta_i, theta_r : tuple of float
        Incident and view zeniths, degrees, [0, 90): a number, a list, or {start, stop, step}.
    phi_i, phi_r : tuple of float
        Azimuths, degrees, [−360, 360]; φ = φr − φi counts, and equal φ are one direction. Not given, φi is
        0 and φr is 0 and 180 in plane, or every 15° over the hemisphere.
    region : "in-plane" or "hemispherical"
    """

    theta_i: Series
    theta_r: Series
    phi_i: Series | None = None
    phi_r: Series | None = None
    region: Literal["in-plane", "hemispherical"] = "in-plane"

    @model_validator(mode="after")
    def _check_directions(self) -> DirectionGrid:
        zenith = _inside(0.0, 90.0, "zenith angles lie in [0°, 90°)")
        azimuth = _inside(-360.0, 360.0000001, "azimuths lie in [-360°, 360°]")
        for name, check in (("theta_i", zenith), ("theta_r", zenith), ("phi_i", azimuth), ("phi_r", azimuth)):
            values = getattr(self, name)
            if values is None:
                continue
            if not values:
                raise ValueError(f"{name} is empty: the {self.kind()} has no points; give at least one angle")
            try:
                check(values)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
        if self.region == "in-plane":
            off = [phi for phi in self.azimuths() if phi not in (0.0, 180.0)]
            if off:
                raise ValueError(
                    f'phi_r - phi_i = {off[0]:g}° is out of plane; give 0 or 180, or region = "hemispherical"'
                )
        return self

    def kind(self) -> str:
        """Return what messages call the file that these directions stand in."""
        return "scene"

    def azimuths(self) -> list[float]:
        """Return the distinct φ = φr − φi, degrees, [0, 360), in their order."""
        phi_i = self.phi_i if self.phi_i is not None else (0.0,)
        if self.phi_r is not None:
            phi_r: tuple[float, ...] = self.phi_r
        else:
            in_plane = (0.0, 180.0)
            phi_r = in_plane if self.region == "in-plane" else tuple(15.0 * k for k in range(24))
        return list(dict.fromkeys(round((r - i) % 360.0, 9) % 360.0 for i, r in product(phi_i, phi_r)))

    def directions(self) -> Directions:
        """Return every distinct direction, in order, without repeats.

        Raises
        ------
        InputError
            More than a million.
        """
        azimuths = self.azimuths()
        count = len(self.theta_i) * len(self.theta_r) * len(azimuths) * self.repetitions()
        if count > MOST_POINTS:
            raise InputError(f"the {self.kind()} has {count} points; at most {MOST_POINTS} fit one scan")
        # Where a zenith is 0 the azimuth means nothing: one point stands for all.
        seen = dict.fromkeys(
            (i, r, phi if i > 0.0 and r > 0.0 else 180.0)
            for i, phi, r in product(self.theta_i, azimuths, self.theta_r)
        )
        rows = np.array(list(seen))
        return Directions.relative(rows[:, 0], rows[:, 1], rows[:, 2])

    def repetitions(self) -> int:
        """How often each direction is measured."""
        return 1

"""The plan file: where to look, how often, how long."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.rig.tomlfile import Settings, load_toml

MOST_POINTS = 1_000_000


def _angles(value: Any) -> Any:
    """Read a number, a list of numbers, or {start, stop, step} with both ends included."""
    if isinstance(value, Mapping):
        if set(value) != {"start", "stop", "step"}:
            raise ValueError("a range has the keys start, stop and step")
        start, stop, step = (value[key] for key in ("start", "stop", "step"))
        if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in (start, stop, step)):
            raise ValueError("start, stop and step are numbers")
        if step == 0 or (stop - start) / step < 0:
            raise ValueError(f"no step of {step:g} leads from {start:g} to {stop:g}")
        count = int(np.floor((stop - start) / step * (1.0 + 1e-12) + 1e-9)) + 1
        if count > MOST_POINTS:
            raise ValueError(f"{count} values; at most {MOST_POINTS}")
        return [start + k * step for k in range(count)]
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _inside(low: float, high: float, words: str) -> Any:
    def check(values: tuple[float, ...]) -> tuple[float, ...]:
        for value in values:
            if not low <= value < high:
                raise ValueError(f"{value:g}°; {words}")
        return values

    return check


Angles = Annotated[tuple[float, ...], BeforeValidator(_angles)]


class WavelengthGrid(Settings):
    """The regular grid of the result, nm, both ends included."""

    start: Annotated[float, Field(ge=150.0, le=5000.0)] = 380.0
    stop: Annotated[float, Field(ge=150.0, le=5000.0)] = 760.0
    step: Annotated[float, Field(gt=0.0, le=1000.0)] = 5.0

    @model_validator(mode="after")
    def _check(self) -> WavelengthGrid:
        if self.stop < self.start:
            raise ValueError(f"stop {self.stop:g} nm lies below start {self.start:g} nm")
        return self


class Plan(Settings):
    """A measurement plan.

    Attributes
    ----------
    theta_i, theta_r : tuple of float
        Incident and view zeniths, degrees, [0, 90): a number, a list, or {start, stop, step}.
    phi_i, phi_r : tuple of float
        Azimuths, degrees, [−360, 360]. Three axes set φ = φr − φi; equal φ are measured once. Not
        given, φi is 0 and φr is 0 and 180 in plane, or every 15° over the hemisphere.
    region : "in-plane" or "hemispherical"
    order : "shortest" or "given"
        "shortest" arranges the points so that the stages travel less.
    repeats : int
        Measurements of each direction.
    dark_every, reference_every : int
        A dark spectrum serves at most this many rows, the incident power this many.
    integration_time : "auto" or float
        s; "auto" takes for each direction the longest that does not saturate.
    shortest_time, longest_time : float
        Limits of "auto", s.
    wavelength : WavelengthGrid
    """

    sample: str = ""
    theta_i: Angles
    theta_r: Angles
    phi_i: Angles | None = None
    phi_r: Angles | None = None
    region: Literal["in-plane", "hemispherical"] = "in-plane"
    order: Literal["shortest", "given"] = "shortest"
    repeats: Annotated[int, Field(ge=1, le=10_000)] = 1
    dark_every: Annotated[int, Field(ge=1)] = 50
    reference_every: Annotated[int, Field(ge=1)] = 200
    integration_time: Literal["auto"] | Annotated[float, Field(ge=10e-6, le=85.0)] = "auto"
    shortest_time: Annotated[float, Field(ge=10e-6, le=85.0)] = 10e-6
    longest_time: Annotated[float, Field(ge=10e-6, le=85.0)] = 2.0
    wavelength: WavelengthGrid = WavelengthGrid()

    @model_validator(mode="after")
    def _check(self) -> Plan:
        zenith = _inside(0.0, 90.0, "zenith angles lie in [0°, 90°)")
        azimuth = _inside(-360.0, 360.0000001, "azimuths lie in [-360°, 360°]")
        for name, check in (("theta_i", zenith), ("theta_r", zenith), ("phi_i", azimuth), ("phi_r", azimuth)):
            values = getattr(self, name)
            if values is None:
                continue
            if not values:
                raise ValueError(f"{name} is empty: the plan has no points; give at least one angle")
            try:
                check(values)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
        if self.longest_time < self.shortest_time:
            raise ValueError(
                f"longest_time {self.longest_time:g} s is below shortest_time {self.shortest_time:g} s"
            )
        if self.region == "in-plane":
            off = [phi for phi in self.azimuths() if phi not in (0.0, 180.0)]
            if off:
                raise ValueError(
                    f'phi_r - phi_i = {off[0]:g}° is out of plane; give 0 or 180, or region = "hemispherical"'
                )
        return self

    def azimuths(self) -> list[float]:
        """Return the distinct φ = φr − φi, degrees, [0, 360), in the order of the plan."""
        phi_i = self.phi_i if self.phi_i is not None else (0.0,)
        if self.phi_r is not None:
            phi_r: tuple[float, ...] = self.phi_r
        else:
            in_plane = (0.0, 180.0)
            phi_r = in_plane if self.region == "in-plane" else tuple(15.0 * k for k in range(24))
        return list(dict.fromkeys(round((r - i) % 360.0, 9) % 360.0 for i, r in product(phi_i, phi_r)))

    def directions(self) -> Directions:
        """Return every distinct direction of the plan, in its order, without repeats.

        Raises
        ------
        InputError
            More than a million.
        """
        azimuths = self.azimuths()
        count = len(self.theta_i) * len(self.theta_r) * len(azimuths) * self.repeats
        if count > MOST_POINTS:
            raise InputError(f"the plan has {count} points; at most {MOST_POINTS} fit one scan")
        # Where a zenith is 0 the azimuth means nothing: one point stands for all.
        seen = dict.fromkeys(
            (i, r, phi if i > 0.0 and r > 0.0 else 180.0)
            for i, phi, r in product(self.theta_i, azimuths, self.theta_r)
        )
        rows = np.array(list(seen))
        return Directions(rows[:, 0], rows[:, 1], rows[:, 2])


def load_plan(path: str | Path) -> Plan:
    """Read a plan file.

    Raises
    ------
    InputError
        As `load_toml`: impossible angles, unknown keys, no points among the reasons.
    """
    plan = load_toml(path, Plan)
    try:
        plan.directions()
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return plan

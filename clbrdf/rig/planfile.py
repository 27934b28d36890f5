"""The plan file: where to look, how often, how long."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from clbrdf.errors import InputError
from clbrdf.grid import DirectionGrid
from clbrdf.rig.adaptive.settings import LEAST_INCIDENT, Adaptive
from clbrdf.storage.tomlfile import TomlTable, load_toml


class WavelengthGrid(TomlTable):
    """The regular grid of the result, nm, both ends included."""

    start: Annotated[float, Field(ge=150.0, le=5000.0)] = 380.0
    stop: Annotated[float, Field(ge=150.0, le=5000.0)] = 760.0
    step: Annotated[float, Field(gt=0.0, le=1000.0)] = 5.0

    @model_validator(mode="after")
    def _check(self) -> WavelengthGrid:
        if self.stop < self.start:
            raise ValueError(f"stop {self.stop:g} nm lies below start {self.start:g} nm")
        return self


class Plan(DirectionGrid):
    """A measurement plan.

    Attributes
    ----------
    theta_i, theta_r, phi_i, phi_r, region
        As in `DirectionGrid`. Three axes set φ = φr − φi; equal φ are measured once.
    order : "shortest" or "given"
        "shortest" arranges the points so that the stages travel less.
    repeats : int
        Measurements of each direction.
    dark_time : float
        A dark spectrum serves at most this long, s.
    dark_drift : float
        It serves no longer where the detector's temperature has changed by more than this, K.
    dark_every : int or None
        It serves at most this many rows, if given.
    reference_every : int
        The incident power serves at most this many rows.
    integration_time : "auto" or float
        s; "auto" takes for each direction the longest that does not saturate.
    shortest_time, longest_time : float
        Limits of "auto", s.
    scans : int
        Scans to sum for each spectrum.
    hdr : int
        Longer integration times to measure besides, for the wavelengths with little light.
    wavelength : WavelengthGrid
    adaptive : Adaptive or None
        Choose among the directions while measuring, instead of taking them all.
    """

    sample: str = ""
    order: Literal["shortest", "given"] = "shortest"
    repeats: Annotated[int, Field(ge=1, le=10_000)] = 1
    dark_time: Annotated[float, Field(gt=0.0, le=86400.0)] = 600.0
    dark_drift: Annotated[float, Field(gt=0.0)] = 0.5
    dark_every: Annotated[int, Field(ge=1)] | None = None
    reference_every: Annotated[int, Field(ge=1)] = 200
    integration_time: Literal["auto"] | Annotated[float, Field(ge=10e-6, le=85.0)] = "auto"
    shortest_time: Annotated[float, Field(ge=10e-6, le=85.0)] = 10e-6
    longest_time: Annotated[float, Field(ge=10e-6, le=85.0)] = 2.0
    scans: Annotated[int, Field(ge=1, le=10_000)] = 1
    hdr: Annotated[int, Field(ge=0, le=6)] = 0
    wavelength: WavelengthGrid = WavelengthGrid()
    adaptive: Adaptive | None = None

    @model_validator(mode="after")
    def _check(self) -> Plan:
        if self.longest_time < self.shortest_time:
            raise ValueError(
                f"longest_time {self.longest_time:g} s is below shortest_time {self.shortest_time:g} s"
            )
        if self.adaptive is not None:
            if self.repeats > 1:
                raise ValueError("[adaptive] chooses each point by itself; leave repeats out")
            if len(set(self.theta_i)) < LEAST_INCIDENT:
                raise ValueError(
                    f"[adaptive] needs at least {LEAST_INCIDENT} incident angles and theta_i has"
                    f" {len(set(self.theta_i))}; give more, or leave [adaptive] out for a fixed route"
                )
        return self

    def kind(self) -> str:
        """Return what messages call it."""
        return "plan"

    def repetitions(self) -> int:
        """How often each direction is measured."""
        return self.repeats


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

"""The error budget of an absolute BRDF, equations (3) to (7).

    ε_BRDF² = ε_ME² + ε_IE² + ε_DE² + ε_PE²                                   (3)
    mechanical (4), illumination (5), detection (6), personal; in sum 6.05 %  (7)

Sources that shift all points alike (scale) are kept apart from those that differ from point to point, from
one incident angle to the next, or from one run between two references to the next: calibration writes each
as a component of the scan's uncertainty. A raw scan gives some sources measured at each of its points; they
replace the percentage that stands for them in the table.

Source: H. Wang, W. Zhang, A. Dong, Measurement 46 (2013) 3654–3661, equations (3)–(7).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from clbrdf.storage.tomlfile import TomlTable, load_toml

GROUPS = {
    "mechanical": "(4)",
    "illumination": "(5)",
    "detection": "(6)",
    "personal": "",
}
"""The terms of (3), with the equation each is."""

Measured = Literal["", "counting", "reference", "angle", "stray_light"]

Kind = Literal["scale", "incident angle", "run", "point"]

KINDS: tuple[Kind, ...] = ("scale", "incident angle", "run", "point")
"""What has an error in common: all points, those of one incident angle, those that share a reading of the
direct beam or the panel, or nothing."""


class ErrorSource(TomlTable):
    """One source of error.

    Attributes
    ----------
    name : str
    percent : float
        Standard uncertainty of the BRDF, %.
    kind : "scale", "incident angle", "run" or "point"
        Which points it shifts alike: all, those of one incident angle, those between two references, none.
    wavelength : "systematic", "random" or float
        Whether it shifts all wavelengths of a point alike, each by itself, or those within so many nm (the
        width of a bell).
    measured : str
        The source measured at each point that takes its place where a raw scan is given.
    """

    name: str
    percent: Annotated[float, Field(ge=0.0, lt=1000.0)]
    kind: Kind = "scale"
    wavelength: Literal["systematic", "random"] | Annotated[float, Field(gt=0.0)] = "systematic"
    measured: Measured = ""


class PointSources(TomlTable):
    """Sources that a raw scan gives at each point.

    Attributes
    ----------
    counting : bool
        Counting and read noise of spectrum, dark and direct beam.
    reference : bool
        Noise of the readings of the reference power.
    angle : float
        Standard uncertainty of each axis, degrees; times the local slope of the BRDF.
    stray_light : float
        Standard uncertainty of stray light, as a share of the mean signal over all pixels.
    """

    counting: bool = True
    reference: bool = True
    angle: Annotated[float, Field(ge=0.0, lt=10.0)] = 0.0
    stray_light: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0


class Budget(TomlTable):
    """A budget; without arguments the paper's.

    The paper gives the mechanical sources (rotation < 0.0003°, holder height 0.03 mm, detector
    displacement 0.01 mm) only in sum, as 3.34 %.
    """

    mechanical: tuple[ErrorSource, ...] = (
        ErrorSource(name="rotation, holder height, displacement", percent=3.34),
    )
    illumination: tuple[ErrorSource, ...] = (
        ErrorSource(name="lamp stability", percent=0.1, kind="point", measured="reference"),
        ErrorSource(name="drift of the reflected luminance", percent=0.4, kind="run"),
        ErrorSource(name="stray light", percent=1.0, measured="stray_light"),
    )
    detection: tuple[ErrorSource, ...] = (
        ErrorSource(
            name="signal to noise", percent=0.4, kind="point", wavelength="random", measured="counting"
        ),
        ErrorSource(name="nonlinearity", percent=0.4),
        ErrorSource(name="solid angle of the receiver", percent=0.7),
    )
    personal: tuple[ErrorSource, ...] = (ErrorSource(name="different readers", percent=4.84),)
    points: PointSources = PointSources()

    def sources(self, group: str) -> tuple[ErrorSource, ...]:
        """Return the sources of one term of (3)."""
        found: tuple[ErrorSource, ...] = getattr(self, group)
        return found

    def is_measured(self, source: ErrorSource) -> bool:
        """Say whether a raw scan takes the place of this percentage."""
        return bool(source.measured) and bool(getattr(self.points, source.measured))

    def remaining(self, kind: Kind) -> float:
        """Return the relative uncertainty from the percentages of a kind that no raw scan replaces."""
        return root_sum_square([s.percent / 100.0 for s in self.remaining_sources() if s.kind == kind])

    def remaining_sources(self) -> list[ErrorSource]:
        """Return the sources that no raw scan replaces and that do something."""
        every = [source for group in GROUPS for source in self.sources(group)]
        return [source for source in every if source.percent > 0.0 and not self.is_measured(source)]


POINTS_ONLY = Budget(
    mechanical=(),
    illumination=(),
    detection=(),
    personal=(),
    points=PointSources(counting=True, reference=True),
)
"""What a raw scan itself tells, and nothing else."""


def root_sum_square(parts: list[float]) -> float:
    """√Σ x²: sources are independent."""
    return math.sqrt(math.fsum(x * x for x in parts))


def group_percent(budget: Budget, group: str) -> float:
    """Return one term of (3), %."""
    return root_sum_square([source.percent for source in budget.sources(group)])


def kind_percent(budget: Budget, kind: str) -> float:
    """Return the part of one kind, %."""
    every = [source for group in GROUPS for source in budget.sources(group)]
    return root_sum_square([source.percent for source in every if source.kind == kind])


def total_percent(budget: Budget) -> float:
    """ε_BRDF of (3), %."""
    return root_sum_square([group_percent(budget, group) for group in GROUPS])


def load_budget(path: str | Path | None) -> Budget:
    """Read a budget file; None is the paper's budget. A group left out keeps the paper's sources.

    Raises
    ------
    InputError
        As `load_toml`.
    """
    return Budget() if path is None else load_toml(path, Budget)

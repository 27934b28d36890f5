"""The section [adaptive] of a plan file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from clbrdf.errors import InputError
from clbrdf.models import Model, get_model
from clbrdf.storage.tomlfile import TomlTable

LEAST_INCIDENT = 3
"""Incident angles without which Fresnel and shadowing terms cannot be told from a scale."""


class Adaptive(TomlTable):
    """Measure until a target is reached, where it tells most, among the plan's directions.

    Attributes
    ----------
    model : str
        A name of `clbrdf.models`, sums too.
    fix : mapping of str to float
        Parameters that are not fitted.
    parameters : tuple of str
        Those whose relative standard uncertainty has to come down to `sigma`, at the worst of the
        wavelengths fitted.
    sigma : float or None
        The target of `parameters`, relative.
    hemisphere : float or None
        Target of the relative standard uncertainty of the BRDF, root mean square over the view hemisphere,
        weighted by cosθr, at the plan's incident angles.
    time : float or None
        Seconds of the rig to spend: travel, exposures and exchanges as estimated, no waiting.
    points : int
        At most this many.
    start, batch : int
        Points of the uniform start; points chosen at a time, between two fits.
    spread : float
        Share of a batch that fills space, whatever the model says.
    validation : int
        Points of each batch that are kept out of the fit.
    separation : float
        Least angle between two points, degrees.
    wavelengths : int
        At most so many, evenly spread, are fitted while measuring.
    seed : int
        Of the fits.
    """

    model: str
    fix: Annotated[dict[str, float], Field(default_factory=dict)]
    parameters: tuple[str, ...] = ()
    sigma: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    hemisphere: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    time: Annotated[float, Field(gt=0.0)] | None = None
    points: Annotated[int, Field(ge=8, le=100_000)] = 1000
    start: Annotated[int, Field(ge=6, le=1000)] = 16
    batch: Annotated[int, Field(ge=4, le=1000)] = 8
    spread: Annotated[float, Field(ge=0.25, le=1.0)] = 0.5
    validation: Annotated[int, Field(ge=1, le=100)] = 1
    separation: Annotated[float, Field(gt=0.0, le=30.0)] = 0.25
    wavelengths: Annotated[int, Field(ge=1, le=1000)] = 8
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0

    @model_validator(mode="after")
    def _check(self) -> Adaptive:
        try:
            model = get_model(self.model)
            model.check_names(self.fix)
            model.check_names(dict.fromkeys(self.parameters))
        except InputError as error:
            raise ValueError(str(error)) from error
        needed = [row.name for row in model.parameters if row.given == "user" and row.name not in self.fix]
        if needed:
            raise ValueError(f"model {self.model} needs {needed[0]}; add fix = {{ {needed[0]} = ... }}")
        free = free_names(model, self.fix)
        fixed = [name for name in self.parameters if name not in free]
        if fixed:
            raise ValueError(f"{fixed[0]} is fixed and has no uncertainty; take it out of parameters or fix")
        if not free:
            raise ValueError(f"all parameters of model {self.model} are fixed: nothing is left to find out")
        if bool(self.parameters) != (self.sigma is not None):
            raise ValueError(f"parameters and sigma belong together; {self.model} has {', '.join(free)}")
        if self.sigma is not None and self.hemisphere is not None:
            raise ValueError("give sigma or hemisphere, not both")
        if self.sigma is None and self.hemisphere is None and self.time is None:
            raise ValueError("give a target: parameters with sigma, or hemisphere, or time")
        if self.validation >= self.batch // 2:
            raise ValueError(
                f"validation takes {self.validation} of {self.batch} points; leave more for the fit"
            )
        return self

    @property
    def target(self) -> float | None:
        """The relative standard uncertainty to reach, if one was asked for."""
        return self.sigma if self.sigma is not None else self.hemisphere

    def what(self) -> str:
        """Return what the target is of, in words."""
        if self.sigma is not None:
            return f"relative sigma of {', '.join(self.parameters)}"
        return "relative sigma of the BRDF over the hemisphere"


def free_names(model: Model, fix: dict[str, float]) -> list[str]:
    """Return the parameters that a fit finds, in the order of the table."""
    return [row.name for row in model.parameters if not row.given and row.name not in fix]

"""The scene file: what is lit, how, and what looks at it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from clbrdf.errors import InputError
from clbrdf.grid import DirectionGrid, Series
from clbrdf.instrument.settings import Instrument
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.opencl.precision import get_precision
from clbrdf.scene.curve import Curve
from clbrdf.scene.detector import Detector
from clbrdf.scene.effects.dark import DarkSignal
from clbrdf.scene.effects.lamp_drift import LampDrift
from clbrdf.scene.effects.nonlinearity import Nonlinearity
from clbrdf.scene.effects.read_noise import ReadNoise
from clbrdf.scene.effects.reader import Reader
from clbrdf.scene.effects.saturation import Saturation
from clbrdf.scene.effects.shot_noise import ShotNoise
from clbrdf.scene.effects.stray_light import StrayLight
from clbrdf.scene.random_numbers import LARGEST_SEED
from clbrdf.storage.tomlfile import TomlTable, load_toml


class SurfaceSettings(TomlTable):
    """What is lit: a model with parameters over wavelength, or what a file holds.

    Attributes
    ----------
    model : str
    parameters : mapping of str to Curve
        By name; missing ones take the model's defaults.
    terms : tuple of str or None
        Terms of the model that are there; all if not given.
    file : str
        A fit file (its model and parameters) or a scan file (the nearest measured direction), relative to
        the scene file.
    """

    model: str = DEFAULT_MODEL
    parameters: dict[str, Curve] = Field(default_factory=dict)
    terms: tuple[str, ...] | None = None
    file: str = ""

    @model_validator(mode="after")
    def _check(self) -> SurfaceSettings:
        if self.file:
            given = [name for name in ("model", "parameters") if name in self.model_fields_set]
            if given:
                raise ValueError(f"file and {given[0]} both say what the surface is; give one of them")
            return self
        try:
            model = get_model(self.model)
            model.check_names(self.parameters)
        except InputError as error:
            raise ValueError(str(error)) from error
        check_terms(self.terms, tuple(term.name for term in model.terms))
        return self


def check_terms(terms: tuple[str, ...] | None, known: tuple[str, ...]) -> None:
    """Raise ValueError where a term is not among those known."""
    for name in terms or ():
        if name not in known:
            raise ValueError(f"terms: no term is called {name!r}; there are {', '.join(known)}")


class Effects(Instrument):
    """The instrument's effects; each is absent unless it is set, to `true` for its defaults or to a table."""

    lamp_drift: LampDrift | None = None
    stray_light: StrayLight | None = None
    dark: DarkSignal | None = None
    shot_noise: ShotNoise | None = None
    nonlinearity: Nonlinearity | None = None
    read_noise: ReadNoise | None = None
    saturation: Saturation | None = None
    reader: Reader | None = None

    def without(self, names: tuple[str, ...]) -> Effects:
        """Return the effects without some of them."""
        return self.model_copy(update=dict.fromkeys(names))


EFFECTS = tuple(Effects.model_fields)
"""Names of all effects, in the order of the light's path."""


class Scene(TomlTable):
    """A scene.

    Attributes
    ----------
    sample : str
        What the scan calls it.
    seed : int
        Of all random effects.
    rtol : float
        Relative tolerance of the integrals over aperture, beam and slit; never finer than the bound of the
        arithmetic.
    precision : str
        Arithmetic of the model: fast, single, double.
    surface, directions, detector, effects
        See their records.
    wavelength : tuple of float
        nm, increasing: a number, a list, or {start, stop, step}.
    """

    sample: str = ""
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 0
    rtol: Annotated[float, Field(ge=1e-10, lt=1.0)] = 1e-4
    precision: str = "double"
    surface: SurfaceSettings
    directions: DirectionGrid
    wavelength: Series
    detector: Detector = Detector()
    effects: Effects = Effects()

    @field_validator("wavelength")
    @classmethod
    def _check_wavelength(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not values or min(values) <= 0.0 or list(values) != sorted(set(values)):
            raise ValueError("give at least one wavelength; they are positive and increase")
        return values

    @field_validator("precision")
    @classmethod
    def _check_precision(cls, value: str) -> str:
        try:
            get_precision(value)
        except InputError as error:
            raise ValueError(str(error)) from error
        return value


def load_scene(path: str | Path) -> Scene:
    """Read a scene file; the surface's file is found beside it.

    Raises
    ------
    InputError
        As `load_toml`: unknown keys and effects, impossible values, no points among the reasons.
    """
    scene = load_toml(path, Scene)
    if not scene.surface.file:
        return scene
    beside = str(Path(path).parent / scene.surface.file)
    return scene.model_copy(update={"surface": scene.surface.model_copy(update={"file": beside})})

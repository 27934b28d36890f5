"""The instrument's file: what spreads, moves or hides light on its way, as a fit takes it out again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import field_validator, model_validator

from clbrdf.errors import InputError
from clbrdf.instrument.aperture import Aperture
from clbrdf.instrument.bandwidth import Bandwidth
from clbrdf.instrument.beam import Beam
from clbrdf.instrument.footprint import Footprint
from clbrdf.instrument.misalignment import Misalignment
from clbrdf.storage.tomlfile import TomlTable, load_toml


class Instrument(TomlTable):
    """What stands between a surface and its values; each effect is absent unless it is set.

    `true` stands for its defaults, a table for its settings. Of a misalignment, what is random (`stage_i`,
    `stage_r`) is noise to a fit and is not taken out.
    """

    misalignment: Misalignment | None = None
    beam: Beam | None = None
    aperture: Aperture | None = None
    bandwidth: Bandwidth | None = None
    footprint: Footprint | None = None

    @model_validator(mode="before")
    @classmethod
    def _switches(cls, value: Any) -> Any:
        if not isinstance(value, Mapping):
            return value
        return {
            name: {} if setting is True else None if setting is False else setting
            for name, setting in value.items()
        }

    @field_validator("*", mode="before")
    @classmethod
    def _check_form(cls, value: Any) -> Any:
        if not (value is None or isinstance(value, Mapping | TomlTable)):
            raise ValueError(f"{value!r} does not switch an effect on; give true, or a table of its settings")
        return value

    def on(self) -> tuple[str, ...]:
        """Names of the effects that are there, in the order of the light's path."""
        return tuple(name for name in type(self).model_fields if getattr(self, name) is not None)


def load_instrument(path: str | Path) -> Instrument:
    """Read an instrument file.

    Raises
    ------
    InputError
        As `load_toml`; no effect in it that a fit could take out.
    """
    instrument = load_toml(path, Instrument)
    if not instrument.on():
        raise InputError(
            f"{path}: no geometry in it; name an effect, such as [aperture] with angle = 1.0 (degrees)"
        )
    return instrument

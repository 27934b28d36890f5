"""What a scan tells of its instrument beside solid angle and bandpass: effects that a fit can take out.

Names and settings are those of a scene's [effects] and of an instrument file (`clbrdf.instrument`). In the
file they stand in ``instrument/effects``, one group an effect, one field a setting.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from clbrdf.errors import InputError
from clbrdf.records import frozen_map
from clbrdf.storage import hdf5, units
from clbrdf.storage.schema import Item, check_group, clean, read_items

if TYPE_CHECKING:
    import h5py

Effects = Mapping[str, Mapping[str, float | bool]]

SETTINGS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "misalignment": {"tilt": "deg", "tilt_azimuth": "deg", "height": "mm", "distance": "mm"},
        "beam": {"angle": "deg", "focussed": ""},
        "footprint": {"beam": "mm", "field": "mm"},
    }
)
"""Effects in the order of the light's path, their settings, and the unit of each; "" for true or false.

What is random of a misalignment is noise to a fit, and is not among them.
"""

MEANINGS = {
    "misalignment": "the sample leans, or its face is off the axis of rotation",
    "beam": "the source lights the sample from a cone of directions",
    "footprint": "the lit spot against the detector's field",
}

GROUP = "effects"

NOT_KNOWN = "this version of clbrdf does not know; use a newer one"

KNOWN = {unit: units.same_as(unit) for unit in ("deg", "mm")}


def checked_effects(given: Effects) -> Effects:
    """Return effects as read-only mappings, in the order of the light's path.

    Raises
    ------
    InputError
        An unknown effect or setting, or one that is no finite number.
    """
    for name, settings in given.items():
        if name not in SETTINGS:
            raise InputError(f"effects: {name!r} is none that a scan tells of; known: {', '.join(SETTINGS)}")
        for key, value in settings.items():
            if key not in SETTINGS[name]:
                raise InputError(f"effects.{name}: unknown {key!r}; known: {', '.join(SETTINGS[name])}")
            if not (isinstance(value, bool | int | float | np.number | np.bool_) and np.isfinite(value)):
                raise InputError(f"effects.{name}.{key} is {value!r}; give a number")
    out = {}
    for name in SETTINGS:
        if name in given:
            out[name] = frozen_map({key: _plain(name, key, value) for key, value in given[name].items()})
    return frozen_map(out)


def _plain(name: str, key: str, value: Any) -> float | bool:
    return float(value) if SETTINGS[name][key] else bool(value)


def write_effects(instrument: h5py.Group, effects: Effects) -> None:
    """Write effects into the NXinstrument of a scan; nothing where there are none."""
    if not effects:
        return
    group = hdf5.group(instrument, GROUP, "NXcollection")
    for name, settings in effects.items():
        one = hdf5.group(group, name, "NXcollection")
        one.attrs["meaning"] = MEANINGS[name]
        for key, value in settings.items():
            hdf5.field(one, key, np.asarray(value), SETTINGS[name][key])


def read_effects(instrument: h5py.Group) -> dict[str, dict[str, Any]]:
    """Read what `write_effects` wrote; empty where a file tells of none.

    Raises
    ------
    InputError
        An effect or a setting that this version does not know, or one that is no single number.
    """
    if GROUP not in instrument:
        return {}
    group = instrument[GROUP]
    check_group(group)
    out: dict[str, dict[str, Any]] = {}
    for name in group:
        if name not in SETTINGS:
            raise InputError(f"tells of an effect {clean(name)!r}, which {NOT_KNOWN}")
        check_group(group[name])
        for key in group[name]:
            if key not in SETTINGS[name]:
                raise InputError(f"tells of a setting {clean(key)!r} of its {name}, which {NOT_KNOWN}")
        items = [
            Item(key, (), KNOWN.get(unit), "real" if unit else "truth", required=False)
            for key, unit in SETTINGS[name].items()
        ]
        out[name] = {key: values[()].item() for key, values in read_items(group[name], items).items()}
    return out


def effect_rows(effects: Effects) -> list[tuple[str, str]]:
    """Return each effect with its settings in words."""
    return [
        (name, ", ".join(_words(name, key, value) for key, value in settings.items() if value is not False))
        for name, settings in effects.items()
    ]


def _words(name: str, key: str, value: float | bool) -> str:
    unit = {"deg": "°", "mm": " mm", "": ""}[SETTINGS[name][key]]
    return key.replace("_", " ") if value is True else f"{key.replace('_', ' ')} {value:.4g}{unit}"

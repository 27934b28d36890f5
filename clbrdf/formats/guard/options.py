"""What a user may settle, and what the guard tells."""

from __future__ import annotations

from dataclasses import dataclass, fields

from clbrdf.errors import InputError
from clbrdf.formats.reading import SCALES


@dataclass(frozen=True)
class Options:
    """Conventions that the user settles; None leaves a question to the file and its data.

    Attributes
    ----------
    angle : "deg" or "rad"
    length : "nm" or "um"
    origin : "normal" or "specular"
        Where view zeniths are counted from.
    forward : 0 or 180
        Difference φr − φi of the forward half-plane in the file, degrees.
    cosine : bool
        Whether values are multiplied by cosθr.
    scale : key of SCALES
    swap : "none", "polar" or "zeniths"
        Which headings are exchanged: zenith and azimuth, or incident and view zenith.
    wavelength : float
        nm, for a file of one band that names none.
    """

    angle: str | None = None
    length: str | None = None
    origin: str | None = None
    forward: float | None = None
    cosine: bool | None = None
    scale: str | None = None
    swap: str | None = None
    wavelength: float | None = None

    def __post_init__(self) -> None:
        known: dict[str, tuple[object, ...]] = {
            "angle": ("deg", "rad"),
            "length": ("nm", "um"),
            "origin": ("normal", "specular"),
            "forward": (0.0, 180.0),
            "cosine": (True, False),
            "scale": tuple(SCALES),
            "swap": ("none", "polar", "zeniths"),
        }
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and item.name in known and value not in known[item.name]:
                words = ", ".join(str(word) for word in known[item.name])
                raise InputError(f"{item.name} is {value}; give one of {words}")


@dataclass(frozen=True)
class Decision:
    """One convention as it was taken.

    Attributes
    ----------
    name : str
        As in `Options`, or "check" for what was looked at and changes nothing.
    taken : str
        In words.
    why : str
        Who says so, and what the data show.
    """

    name: str
    taken: str
    why: str

    def __str__(self) -> str:
        return f"{self.taken} ({self.why})"

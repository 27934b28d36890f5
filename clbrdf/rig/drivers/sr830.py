"""Stanford Research SR830 lock-in amplifier through pymeasure, with a photodiode and a chopper: the detector.

Source: pymeasure, `pymeasure.instruments.srs.SR830`; Stanford Research Systems, SR830 Operation Manual.
"""

from __future__ import annotations

from typing import Any

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers._lockin import LockIn, LockInConnection
from clbrdf.rig.drivers._single import SingleDetector
from clbrdf.rig.drivers._visa import EXTRA as EXTRA
from clbrdf.rig.drivers._visa import find_resources

ROLES = ("spectrometer",)
OVERLOADS = 0b111
"""Bits of the lock-in status byte (`LIAS?`): input or reserve, time constant filter, output."""


class Connection(LockInConnection):
    """Its VISA resource and the wavelengths."""


def connect(settings: Connection, context: Context) -> SingleDetector:
    """Return the amplifier of a rig file as the detector."""
    return SingleDetector(LockIn("SR830", settings, context, is_overloaded), settings, context)


def is_overloaded(amplifier: Any) -> bool:
    """Say whether an input, filter or output is or was overloaded since the last look."""
    return bool(int(amplifier.ask("LIAS?")) & OVERLOADS)


def find() -> list[FoundInstrument]:
    """Return the resources that may be one: GPIB instruments do not say what they are."""
    return find_resources(lambda name: name.startswith("GPIB"))

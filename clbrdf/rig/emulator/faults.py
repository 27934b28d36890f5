"""Faults that can be injected, when, and a record of those that were."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np

from clbrdf.errors import InputError
from clbrdf.rig.eventlog import now_text

REPLY_FAULTS = {
    "short_read": "the reply ends early and the rest never comes",
    "garbage": "random bytes inside the reply",
    "nul_bytes": "NUL bytes before the reply",
    "lost_byte": "one byte of the reply is lost",
    "no_reply": "the reply is lost",
    "stale_reply": "the reply is held back until the next request",
    "duplicate_reply": "the reply comes twice",
}
LINE_FAULTS = {
    **REPLY_FAULTS,
    "lost_command_byte": "one byte of the request is lost",
    "unplug": "the port vanishes and comes back a moment later",
    "power_cut": "the instrument starts again with its defaults",
}
STAGE_FAULTS = {
    "limit_switch": "the next move runs into a limit switch",
    "stall": "the next move stops on its way",
    "homing_lost": "a stage forgets its reference",
}
SPECTROMETER_FAULTS = {"saturation": "a flash of light saturates the next spectrum"}
REFERENCE_FAULTS = {
    "front_panel": "a hand changes the units to dBm",
    "lamp_out": "the lamp loses a third of its power for a while",
}
FAULTS = {
    "stages": {**LINE_FAULTS, **STAGE_FAULTS},
    "spectrometer": {**LINE_FAULTS, **SPECTROMETER_FAULTS},
    "reference": {**LINE_FAULTS, **REFERENCE_FAULTS},
}
"""By instrument: name and meaning."""


def check_names(names: list[str]) -> None:
    """Raise InputError where a fault of this name does not exist."""
    known = sorted({name for faults in FAULTS.values() for name in faults})
    for name in names:
        if name not in known:
            raise InputError(f"no fault is called {name!r}; there are {', '.join(known)}")


@dataclass(frozen=True)
class Injected:
    """A fault that was injected: when, where, at which exchange."""

    time: str
    instrument: str
    exchange: int
    fault: str
    request: str


@dataclass
class Injector:
    """Decides at every exchange whether a fault happens.

    Attributes
    ----------
    rate : float
        Share of exchanges with a random fault.
    names : list of str
        Faults to choose from at random; all if empty.
    seed : int
    injected : list of Injected
        What happened, in order.
    """

    rate: float = 0.0
    names: list[str] = field(default_factory=list)
    seed: int = 0
    injected: list[Injected] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_names(self.names)
        self._lock = threading.Lock()
        self._planned: dict[str, list[tuple[str, int, str]]] = {name: [] for name in FAULTS}
        self._waiting: dict[str, list[str]] = {name: [] for name in FAULTS}
        self.random = {
            name: np.random.default_rng([self.seed, place]) for place, name in enumerate(sorted(FAULTS))
        }
        self._choices = {
            name: [fault for fault in faults if not self.names or fault in self.names]
            for name, faults in FAULTS.items()
        }

    def inject(self, instrument: str, fault: str, at: int = 0, on: str = "") -> None:
        """Plan a fault at the first exchange from number `at` on whose request contains `on`.

        Raises
        ------
        InputError
            No such instrument, or it cannot have this fault.
        """
        if instrument not in FAULTS:
            raise InputError(f"no instrument is called {instrument!r}; there are {', '.join(FAULTS)}")
        if fault not in FAULTS[instrument]:
            raise InputError(
                f"{instrument} has no fault {fault!r}; there are {', '.join(FAULTS[instrument])}"
            )
        with self._lock:
            self._planned[instrument].append((fault, at, on))

    def draw(self, instrument: str, exchange: int, request: str) -> list[str]:
        """Return the faults waiting for a fitting exchange of an instrument, this one's among them."""
        with self._lock:
            waiting = self._waiting[instrument]
            planned = self._planned[instrument]
            for item in [p for p in planned if exchange >= p[1] and p[2] in request]:
                planned.remove(item)
                waiting.append(item[0])
            choices = self._choices[instrument]
            if self.rate and choices and not waiting and self.random[instrument].random() < self.rate:
                waiting.append(str(self.random[instrument].choice(choices)))
            return list(waiting)

    def happened(self, instrument: str, exchange: int, fault: str, request: str) -> None:
        """Note that a fault took place."""
        with self._lock:
            self._waiting[instrument].remove(fault)
            self.injected.append(Injected(now_text(), instrument, exchange, fault, request))

"""What a driver needs to reach its instrument: keys of the rig file, and what the rig lends it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from clbrdf.rig.errors import InstrumentError
from clbrdf.rig.eventlog import EventLog
from clbrdf.storage.tomlfile import TomlTable


class NoConnection(TomlTable):
    """A driver that needs no keys of its own."""


class SerialConnection(TomlTable):
    """A serial port.

    Attributes
    ----------
    port : str
        Path, relative to the rig file.
    baud : int
        Bits per second.
    patience : float
        Margin on every deadline, s.
    reply_time : float
        Longest time the instrument takes to begin a reply, s.
    """

    port: str
    baud: Annotated[int, Field(ge=300, le=4_000_000)] = 9600
    patience: Annotated[float, Field(gt=0.0, le=60.0)] = 0.3
    reply_time: Annotated[float, Field(gt=0.0, le=60.0)] = 0.02

    def located(self, folder: Path) -> dict[str, str]:
        """Return the port as a path from the folder of the rig file; Windows names stay as they are.

        Raises
        ------
        ValueError
            The port is an address of another kind.
        """
        if "://" in self.port:
            raise ValueError(f"port = {self.port!r}: give the path of a serial port")
        is_windows_port = self.port.upper().startswith("COM")
        return {"port": self.port if is_windows_port else str(folder / self.port)}


def nobody(question: str) -> str:
    """Answer for a person where there is none.

    Raises
    ------
    InstrumentError
        Always.
    """
    raise InstrumentError(
        f"a person is needed ({question}), and there is no terminal: start the measurement in one"
    )


@dataclass(frozen=True)
class Context:
    """What the rig lends a driver.

    Attributes
    ----------
    name : str
        The instrument's part in the rig, for messages: "stages", "spectrometer" or "reference".
    log : EventLog
    ask : callable
        Puts a question to a person and returns the answer; raises InstrumentError where nobody can answer.
    """

    name: str
    log: EventLog
    ask: Callable[[str], str] = nobody


@dataclass(frozen=True)
class FoundInstrument:
    """An instrument that is connected to this computer: its address, and what it says it is."""

    address: str
    what: str

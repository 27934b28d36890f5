"""Instruments through pymeasure and VISA: opened late, and every failure in one line with its mend."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Annotated, Any

from pydantic import Field

from clbrdf.rig.connection import Context, FoundInstrument
from clbrdf.rig.drivers import import_extra
from clbrdf.rig.errors import InstrumentError, NoReplyError, UnpluggedError
from clbrdf.storage.tomlfile import TomlTable

EXTRA = "pymeasure"


class VisaConnection(TomlTable):
    """A VISA resource.

    Attributes
    ----------
    resource : str
        Such as "USB0::0x1313::0x8078::P0012345::INSTR", "GPIB0::8::INSTR" or "ASRL/dev/ttyUSB0::INSTR".
    timeout : float
        Longest time to a reply, s.
    """

    resource: str
    timeout: Annotated[float, Field(gt=0.0, le=60.0)] = 3.0


class VisaInstrument:
    """An instrument of pymeasure, opened by `open`.

    Parameters
    ----------
    module, name : str
        Where pymeasure has its class.
    settings : VisaConnection
    context : Context
    options : mapping
        What its class is made with besides.
    """

    def __init__(
        self, module: str, name: str, settings: VisaConnection, context: Context, **options: Any
    ) -> None:
        self.settings = settings
        self.context = context
        self._module, self._name, self._options = module, name, options
        self._instrument: Any = None

    @property
    def is_open(self) -> bool:
        """False before `open`, and after the connection was lost."""
        return self._instrument is not None

    def open(self) -> None:
        """Connect.

        Raises
        ------
        InstrumentError
            pymeasure is missing, or the resource cannot be opened.
        """
        self.close()
        kind = getattr(import_extra(self._module, EXTRA), self._name)
        resource = self.settings.resource
        try:
            # What pymeasure asks its users about command sets is not our users' matter.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FutureWarning)
                adapter = open_adapter(resource, self.settings.timeout)
                self._instrument = kind(adapter, **self._options)
        except Exception as error:  # VISA libraries raise their own kinds
            raise InstrumentError(f"{self.context.name}: {_why(resource, error)}") from error

    def close(self) -> None:
        """Disconnect."""
        instrument, self._instrument = self._instrument, None
        if instrument is not None:
            with suppress(Exception):
                instrument.adapter.close()

    def identify(self, wanted: str) -> str:
        """Get its identity (`*IDN?`).

        Raises
        ------
        InstrumentError
            It does not contain what is wanted: another instrument answers.
        """
        with self.talking() as instrument:
            text = str(instrument.ask("*IDN?")).strip()
        if wanted not in text:
            raise InstrumentError(
                f"{self.context.name}: {self.settings.resource} is {text[:60]!r}, no {wanted}; check the"
                " resource in the rig file"
            )
        return text

    @contextmanager
    def talking(self) -> Iterator[Any]:
        """Lend the instrument of pymeasure; what goes wrong meanwhile becomes an error of ours.

        Raises
        ------
        NoReplyError
            It did not answer in time, or not as it should.
        UnpluggedError
            The connection is gone.
        """
        if self._instrument is None:
            raise UnpluggedError(f"{self.context.name}: {self.settings.resource} is closed")
        try:
            yield self._instrument
        except InstrumentError:
            raise
        except Exception as error:
            text = " ".join(str(error).split())
            is_lost = isinstance(error, OSError) or "VI_ERROR_CONN_LOST" in text
            if is_lost and "VI_ERROR_TMO" not in text:
                self.close()
                raise UnpluggedError(
                    f"{self.context.name}: lost {self.settings.resource} ({text}); plug it in again"
                ) from error
            self.context.log.add(self.context.name, "bad reply", text)
            raise NoReplyError(
                f"{self.context.name}: no valid reply from {self.settings.resource} ({text})"
            ) from error


def open_adapter(resource: str, timeout: float) -> Any:
    """Return pymeasure's adapter for a VISA resource."""
    adapters = import_extra("pymeasure.adapters", EXTRA)
    return adapters.VISAAdapter(resource, timeout=round(timeout * 1000.0))


def _why(resource: str, error: Exception) -> str:
    text = " ".join(str(error).split())
    if isinstance(error, InstrumentError):
        return text
    if "Could not locate a VISA implementation" in text:
        return "no VISA library is installed; install one with: pip install pyvisa-py"
    if "busy" in text.lower() or "VI_ERROR_RSRC_BUSY" in text or "VI_ERROR_RSRC_LOCKED" in text:
        return f"{resource} is in use by another program; close that one"
    if "Errno 13" in text or "Access denied" in text or "ermission" in text:
        return f"{resource} may not be opened; give this user the right to the device (udev rule, group)"
    return f"{resource} cannot be opened ({text}); check the resource in the rig file"


def find_resources(matches: Callable[[str], bool]) -> list[FoundInstrument]:
    """Return the VISA resources that fit."""
    pyvisa = import_extra("pyvisa", EXTRA)
    try:
        manager = pyvisa.ResourceManager()
        names = manager.list_resources()
    except Exception as error:
        raise InstrumentError(_why("VISA", error)) from error
    return [FoundInstrument(name, "VISA resource") for name in names if matches(name)]

"""What happened during a measurement, line by line, with the time and its zone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path


def now_text() -> str:
    """Local time with its zone, ISO 8601, to the millisecond."""
    return datetime.now().astimezone().isoformat(timespec="milliseconds")


@dataclass(frozen=True)
class Event:
    """One line of the log: when, which instrument, what kind, and the details."""

    time: str
    where: str
    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.time} {self.where}: {self.kind}: {self.text}"


@dataclass
class EventLog:
    """Events in memory and, where a path is given, appended to a text file as they happen.

    Attributes
    ----------
    path : Path or None
        File to append to; a line is flushed as it is written.
    show : callable or None
        Called with each event, to print it.
    """

    path: Path | None = None
    show: Callable[[Event], None] | None = None
    events: list[Event] = field(default_factory=list)

    def add(self, where: str, kind: str, text: str) -> None:
        """Record an event."""
        event = Event(now_text(), where, kind, " ".join(text.split()))
        self.events.append(event)
        if self.path is not None:
            with open(self.path, "a", encoding="utf-8") as stream:
                stream.write(f"{event}\n")
        if self.show is not None:
            self.show(event)

"""Ctrl-C during a measurement, wherever it lands."""

from __future__ import annotations

import signal
import weakref

import pytest

from clbrdf.rig.errors import StoppedError
from clbrdf.rig.interrupt import StopRequest


class Thing:
    """Something that can be referred to weakly, and that a signal may meet as it goes."""

    def __del__(self):
        if self.signals:
            signal.raise_signal(signal.SIGINT)

    signals = False


def in_a_callback():
    thing = Thing()
    reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    del thing
    return reference


def in_a_destructor():
    thing = Thing()
    thing.signals = True
    del thing


@pytest.fixture(autouse=True)
def handlers():
    """A measurement that was stopped leaves signals ignored."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("place", [in_a_callback, in_a_destructor])
def test_a_second_signal_that_python_drops_is_raised_at_the_next_check(place, capsys):
    told = []
    with pytest.raises(KeyboardInterrupt), StopRequest(lambda: told.append(1)) as stop:
        signal.raise_signal(signal.SIGINT)
        assert told == [1]
        place()
        stop.check()
    assert capsys.readouterr().err == ""


def test_first_asks_then_raises():
    with StopRequest(lambda: None) as stop:
        stop.check()
        assert stop.number == 0
        signal.raise_signal(signal.SIGTERM)
        assert stop.number == signal.SIGTERM
        with pytest.raises(StoppedError):
            stop.check()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)

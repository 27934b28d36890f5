"""`clbrdf emulate`: a rig of emulated instruments on pseudo-terminals."""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path
from types import FrameType
from typing import Annotated

from cyclopts import Parameter

from clbrdf.cli.console import print_table
from clbrdf.errors import InputError
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.rigfile import Rig, load_rig


def command(
    rig: Path,
    *,
    fault: Annotated[list[str], Parameter(consume_multiple=True, negative_iterable="")] = [],  # noqa: B006 (cyclopts needs a list)
    fault_rate: float | None = None,
    seed: int | None = None,
) -> None:
    """Emulate the instruments of a rig file at the ports it names, until Ctrl-C.

    Parameters
    ----------
    rig
        rig file (TOML); its ports must be free names
    fault
        instrument:fault@exchange, as often as needed, such as stages:stall@120
    fault_rate
        share of exchanges with a random fault, 0 to 0.5
    seed
        of noise and random faults
    """
    settings = load_rig(rig)
    chosen = _with_options(settings, fault_rate, seed)
    with EmulatedRig(chosen) as emulated:
        for text in fault:
            _inject(emulated, text)
        rows = [
            [name, instrument.port.device, str(instrument.port.link)]
            for name, instrument in emulated.instruments.items()
        ]
        print_table("emulated instruments", ("instrument", "pseudo-terminal", "port"), rows, left=3)
        print(f"measure with: clbrdf measure plan.toml --rig {rig} -o scan.h5     (Ctrl-C ends)")
        sys.stdout.flush()
        _wait_for_stop()
        rows = [
            [
                name,
                f"{instrument.exchanges}",
                f"{sum(i.instrument == name for i in emulated.injector.injected)}",
            ]
            for name, instrument in emulated.instruments.items()
        ]
    print_table("", ("instrument", "exchanges", "faults"), rows)


def _with_options(rig: Rig, fault_rate: float | None, seed: int | None) -> Rig:
    update = {key: value for key, value in (("fault_rate", fault_rate), ("seed", seed)) if value is not None}
    if fault_rate is not None and not 0.0 <= fault_rate <= 0.5:
        raise InputError(f"--fault-rate {fault_rate:g}: give a share from 0 to 0.5")
    if seed is not None and seed < 0:
        raise InputError(f"--seed {seed}: give 0 or more")
    emulator = rig.emulator or EmulatorSettings()
    return rig.model_copy(update={"emulator": emulator.model_copy(update=update)})


def _inject(emulated: EmulatedRig, text: str) -> None:
    instrument, colon, rest = text.partition(":")
    name, _, number = rest.partition("@")
    if not colon or not (number.isdigit() or not number):
        raise InputError(f"--fault {text!r}: write instrument:fault@exchange, as in stages:stall@120")
    emulated.injector.inject(instrument, name, int(number or 0))


def _wait_for_stop() -> None:
    """Return at SIGINT or SIGTERM."""
    done = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        done.set()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        while not done.wait(0.2):
            pass
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

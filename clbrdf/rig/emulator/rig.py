"""All three emulated instruments of a rig file, on pseudo-terminals at the ports it names."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from clbrdf.errors import InputError
from clbrdf.rig.emulator.faults import Injector
from clbrdf.rig.emulator.instrument import EmulatedDevice, EmulatedInstrument
from clbrdf.rig.emulator.port import PseudoTerminal
from clbrdf.rig.emulator.powermeter import EmulatedPowerMeter
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.emulator.spectrometer import EmulatedSpectrometer
from clbrdf.rig.emulator.stages import EmulatedStages
from clbrdf.rig.emulator.world import Clock, World
from clbrdf.rig.rigfile import Rig

DRIVERS = {"stages": "smc100", "spectrometer": "obp", "reference": "newport1830c"}
"""The parts that can be emulated."""


class EmulatedRig:
    """A context in which the ports of a rig file lead to emulated instruments.

    Parts with another driver are left alone: they are real, or the test's own.

    Attributes
    ----------
    injector : Injector
        Plans faults and remembers those that happened.
    instruments : dict of str to EmulatedInstrument

    Raises
    ------
    InputError
        The rig file has no part that is emulated, or a port cannot be put where it says.
    """

    def __init__(self, rig: Rig) -> None:
        settings = rig.emulator or EmulatorSettings()
        emulated = [name for name, driver in DRIVERS.items() if getattr(rig, name).driver == driver]
        if not emulated:
            raise InputError(f"none of its drivers is emulated; those are {', '.join(DRIVERS.values())}")
        self.rig = rig
        self.injector = Injector(settings.fault_rate, list(settings.faults), settings.seed)
        clock = Clock(settings.time_factor)
        self.world = World(rig, settings, clock)
        effects = settings.effects
        self.devices: dict[str, EmulatedDevice] = {}
        if "stages" in emulated:
            stages = EmulatedStages(rig.stages, clock, effects.angle_noise, settings.seed, effects.hunting)
            self.world.axes = stages.true_angles
            self.devices["stages"] = stages
        if "spectrometer" in emulated:
            self.devices["spectrometer"] = EmulatedSpectrometer(self.world, settings.left)
        if "reference" in emulated:
            self.devices["reference"] = EmulatedPowerMeter(self.world, settings.left.meter)
        self.instruments: dict[str, EmulatedInstrument] = {}
        for name, device in self.devices.items():
            part = getattr(rig, name)
            port = PseudoTerminal(Path(part.port), part.baud if settings.line_speed else None)
            self.instruments[name] = EmulatedInstrument(device, port, self.injector)

    def __enter__(self) -> EmulatedRig:
        opened: list[EmulatedInstrument] = []
        try:
            for instrument in self.instruments.values():
                instrument.port.plug()
                opened.append(instrument)
        except InputError:
            for instrument in opened:
                instrument.port.unplug()
            raise
        for instrument in opened:
            instrument.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for instrument in self.instruments.values():
            instrument.close()

    @property
    def exchanges(self) -> int:
        """Requests answered so far, by all instruments."""
        return sum(instrument.exchanges for instrument in self.instruments.values())

"""Rigs and plans for tests: the sample rig, made quick, in a folder of its own."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

from clbrdf.rig import drivers
from clbrdf.rig.connection import Context
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.instruments import make_instruments
from clbrdf.rig.measure import never
from clbrdf.rig.rigfile import Rig, load_rig

RIG = """
name = "test rig"
[stages]
port = "ports/stages"
baud = 921600
patience = {patience}
poll = 0.0002
homing_time = 4.0
reset_time = 2.3
move_time = {patience}
lamp  = {{ address = 1, limits = [-180, 181], velocity = 20, acceleration = 80, zero = 10.0 }}
turn  = {{ address = 2, limits = [-95, 95], velocity = 20, acceleration = 80, sign = -1 }}
pitch = {{ address = 3, limits = [-90, 90], velocity = 20, acceleration = 80 }}
[spectrometer]
port = "ports/spectrometer"
baud = 921600
patience = {patience}
electrons_per_count = 2.0
read_noise = 3.0
bias = 1500
shutter_time = 0
{spectrometer}
[reference]
port = "ports/reference"
baud = 921600
patience = {patience}
reply_time = 0.05
noise = {reference_noise}
band = 0.05
wait = 20
every = 0.002
[geometry]
solid_angle = 1.0e-3
[storage]
keep_free = {keep_free}
[recovery]
attempts = {attempts}
replug_time = 10
[emulator]
direct_rate = 1.0e8
line_speed = false
time_factor = 2000
seed = {seed}
fault_rate = {fault_rate}
{emulator}
[emulator.effects]
{effects}
"""

PLAN = """
sample = "tin foil"
theta_i = [30, 45]
theta_r = {{ start = 0, stop = 60, step = {step} }}
phi_r = 180
integration_time = {time}
dark_every = {dark_every}
reference_every = {reference_every}
{more}
wavelength = {{ start = 500, stop = 600, step = 10 }}
"""


def write_rig(
    folder: Path,
    *,
    seed: int = 0,
    effects: str = "",
    emulator: str = "",
    spectrometer: str = "",
    fault_rate: float = 0.0,
    reference_noise: float = 0.0,
    keep_free: float = 0.0,
    attempts: int = 8,
    patience: float = 2.0,
) -> Path:
    path = folder / "rig.toml"
    path.write_text(
        RIG.format(
            seed=seed,
            effects=effects,
            emulator=emulator,
            spectrometer=spectrometer,
            fault_rate=fault_rate,
            reference_noise=reference_noise,
            keep_free=keep_free,
            attempts=attempts,
            patience=patience,
        )
    )
    return path


def write_plan(
    folder: Path,
    *,
    step: float = 10.0,
    time: float | str = '"auto"',
    dark_every: int = 50,
    reference_every: int = 100,
    more: str = "",
) -> Path:
    path = folder / "plan.toml"
    path.write_text(
        PLAN.format(step=step, time=time, dark_every=dark_every, reference_every=reference_every, more=more)
    )
    return path


@contextmanager
def connected(rig: Rig, emulated: EmulatedRig):
    """Instruments connected and homed, with their log."""
    log = EventLog()
    instruments = make_instruments(rig, log, never)
    try:
        instruments.connect()
        instruments.home()
        yield instruments, log
    finally:
        instruments.close()


@contextmanager
def emulation(folder: Path, **options):
    """The rig file, the rig, and its emulated instruments."""
    path = write_rig(folder, **options)
    rig = load_rig(path)
    with EmulatedRig(rig) as emulated:
        yield path, rig, emulated


def context(name="spectrometer", answers=()):
    replies = iter(answers)
    return Context(name, EventLog(), lambda question: next(replies, ""))


def settings(driver, role, **keys):
    return drivers.connection_of(role, drivers.get_driver(role, driver)).model_validate(keys)


def with_spectrometer(folder, text):
    """The test rig with another section for the spectrometer."""
    path = write_rig(folder)
    rest = path.read_text()
    start, end = rest.index("[spectrometer]"), rest.index("[reference]")
    path.write_text(rest[:start] + text + rest[end:])
    return path

"""`clbrdf align`: angular zeros and tilt from the specular peak; wavelengths from the lines of a lamp."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from clbrdf.cli.console import print_table
from clbrdf.cli.options import JsonFile, Overwrite
from clbrdf.errors import InputError
from clbrdf.parallel.ending import exit_status
from clbrdf.rig.align import Alignment, align
from clbrdf.rig.connection import nobody
from clbrdf.rig.errors import InstrumentError, StoppedError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.instruments import Instruments, make_instruments
from clbrdf.rig.interrupt import StopRequest
from clbrdf.rig.lamplines import MIDDLE, Correction, find_correction
from clbrdf.rig.lightmeter import LightMeter
from clbrdf.rig.rigfile import Rig, load_rig
from clbrdf.rig.stagesettings import AXES
from clbrdf.rig.terminal import make_ask
from clbrdf.storage.files import check_output, whole_text

Numbers = Annotated[list[float], Parameter(consume_multiple=True, negative_iterable="")]
Words = Annotated[list[str], Parameter(consume_multiple=True, negative_iterable="")]


def command(
    *,
    rig: Path,
    lamp: Numbers = [50.0, 80.0, 110.0],  # noqa: B006 (cyclopts needs a list)
    reach: float = 3.0,
    step: float = 0.25,
    lines: Words = [],  # noqa: B006
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the errors of the axes and the sample's tilt, and say what to write into the rig file.

    A glossy sample or a mirror has to be in the holder: the lamp's zero comes from the direct beam, those
    of turn and pitch, the sample's tilt included, from specular peaks. With --lines a line lamp has to
    shine into the detector, and the wavelengths are corrected instead. Nothing is changed by itself.

    Parameters
    ----------
    rig
        rig file (TOML)
    lamp
        lamp angles at which the specular peak is measured, degrees
    reach
        how far from its nominal place a peak is looked for, degrees
    step
        how finely it is looked for, degrees; a mirror's peak needs a small one
    lines
        elements in the lamp, such as Hg Ar: correct the wavelengths
    """
    if json is not None:
        check_output(json, overwrite)
    settings = load_rig(rig)
    _check(settings, lamp, reach, step)
    with StopRequest(lambda: None) as stop:
        try:
            content = _with_instruments(settings, lambda: stop.check(), lamp, reach, step, lines)
        except StoppedError:
            print("clbrdf: stopped; nothing was changed", file=sys.stderr)
            return exit_status(stop.number)
    if json is not None:
        whole_text(json, content, overwrite)
    return 0


def _check(rig: Rig, lamps: list[float], reach: float, step: float) -> None:
    if not (math.isfinite(reach) and math.isfinite(step) and 0.0 < step <= reach <= 20.0):
        raise InputError(
            f"--reach {reach:g} --step {step:g}: give degrees, the step below the reach, at most 20"
        )
    low, high = rig.stages.lamp.limits
    for angle in lamps:
        if not max(low, 2.0 * rig.geometry.lamp_shadow) <= angle <= min(high, 160.0):
            raise InputError(f"--lamp {angle:g}: give angles within the lamp's limits, up to 160°")


def _with_instruments(
    rig: Rig,
    check: Callable[[], None],
    lamps: list[float],
    reach: float,
    step: float,
    elements: list[str],
) -> dict[str, Any]:
    log = EventLog()
    ask = make_ask(check) if sys.stderr.isatty() else nobody
    instruments = make_instruments(rig, log, check, ask)
    try:
        instruments.connect()
        instruments.home()
        meter = LightMeter(instruments, log, check)
        if elements:
            return _wavelengths(instruments, meter, elements)
        limits = [getattr(rig.stages, name).limits for name in AXES]
        position = rig.stages.tolerance / 2.0
        result = align(_signal_of(meter), rig.geometry.direct, lamps, reach, step, position, limits)
        instruments.stages.park()
    except InstrumentError as error:
        raise InstrumentError(f"{error}; nothing was changed") from error
    finally:
        instruments.make_safe()
        instruments.close()
    return _print_alignment(rig, result)


def _signal_of(
    meter: LightMeter,
) -> Callable[[tuple[float, float, float]], tuple[tuple[float, ...], float, float]]:
    def measure(axes: tuple[float, float, float]) -> tuple[tuple[float, ...], float, float]:
        light = meter.measure(axes)
        return light.axes, *light.total()

    return measure


def _print_alignment(rig: Rig, result: Alignment) -> dict[str, Any]:
    rows, content = [], {}
    for name in AXES:
        estimate, stage = getattr(result, name), getattr(rig.stages, name)
        zero = stage.zero - stage.sign * estimate.value
        rows.append(
            [name, f"{estimate.value:+.4f}", f"{estimate.sigma:.4f}", f"{stage.zero:.4f}", f"{zero:.4f}"]
        )
        content[name] = {"error": estimate.value, "sigma": estimate.sigma, "zero": zero}
    columns = ("axis", "stands off by (°)", "σ (°)", "zero now (°)", "zero to write (°)")
    print_table("Alignment; turn and pitch with the sample's tilt", columns, rows)
    if math.isfinite(result.chi2) and result.chi2 > 5.0:
        print(
            f"the peaks at the lamp's angles disagree (reduced χ² {result.chi2:.1f}): the lamp's path or the"
            " sample's place may be off the axes"
        )
    return content


def _wavelengths(instruments: Instruments, meter: LightMeter, elements: list[str]) -> dict[str, Any]:
    light = meter.measure(instruments.rig.geometry.direct)
    wavelength = instruments.spectrometer.get_wavelengths()
    found: Correction = find_correction(wavelength, light.spectrum, light.variance, elements)
    rows = [
        [f"{x.true:.3f}", f"{x.found:.3f}", f"{x.true - x.found:+.3f}", f"{x.sigma:.3f}"] for x in found.lines
    ]
    print_table("Lines", ("true (nm)", "found (nm)", "difference", "σ (nm)"), rows)
    text = f"[{found.offset:.4f}, {found.slope:.3e}]"
    print(
        f"write into [spectrometer]: wavelength_correction = {text}   # nm, and nm per nm from {MIDDLE:g} nm"
    )
    return {
        "wavelength_correction": [found.offset, found.slope],
        "sigma": [found.offset_sigma, found.slope_sigma],
    }

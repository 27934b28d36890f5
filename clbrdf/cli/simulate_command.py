"""`clbrdf simulate`: a synthetic scan with the effects asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from clbrdf.cli.checks import print_surface_checks, say
from clbrdf.cli.console import number, print_table, progress_bar
from clbrdf.cli.options import DeviceName, Overwrite
from clbrdf.errors import InputError
from clbrdf.opencl.device import choose_device
from clbrdf.opencl.precision import get_precision
from clbrdf.scene.ledger import Ledger, keep_ledger
from clbrdf.scene.random_numbers import LARGEST_SEED
from clbrdf.scene.reduce import reduce_scene
from clbrdf.scene.scenefile import load_scene
from clbrdf.scene.simulate import Setting, set_up
from clbrdf.scene.stream import Streamed, stream
from clbrdf.scene.surface import ModelSurface
from clbrdf.storage.files import check_apart, check_output
from clbrdf.storage.provenance import made_by

Flag = Parameter(negative="")

LEAST_RTOL = 1e-11
"""A quarter of it is what the model's arithmetic may use, and double precision keeps 5e-13."""

WORTH_A_WORD = 1e-3
"""Effects that move the result by less are named below the ledger."""


def command(
    scene: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"], help="scan file to write")] = None,
    ledger: Annotated[bool, Flag] = False,
    rtol: float | None = None,
    check: Annotated[bool, Flag] = False,
    precision: str | None = None,
    seed: int | None = None,
    device: DeviceName = None,
    overwrite: Overwrite = False,
) -> None:
    """Simulate a scene: a scan whose truth is known, with the instrument effects that the scene asks for.

    Parameters
    ----------
    scene
        scene file (TOML): surface, directions, wavelength, and effects, none by default
    ledger
        print what each effect costs, and how far it moves the result
    rtol
        leave out or coarsen what moves the result by less, relative, and say so
    check
        print the surface's directional-hemispherical reflectance, and whether it is reciprocal
    precision
        arithmetic of the model in place of the scene's: fast (or fast:3 to fast:6), single, double
    seed
        of the random effects in place of the scene's
    """
    if output is None and not (ledger or check):
        raise InputError("nothing to do: name a scan file with -o, or ask for --ledger or --check")
    if rtol is not None and not LEAST_RTOL <= rtol <= 1.0:
        raise InputError(f"rtol is {rtol:g}; give {LEAST_RTOL:g} to 1")
    if rtol is not None and precision is not None:
        raise InputError("--precision and --rtol both choose the arithmetic; give one of them")
    if seed is not None and not 0 <= seed <= LARGEST_SEED:
        raise InputError(f"--seed is {seed}; give a whole number from 0 to {LARGEST_SEED}")
    told = load_scene(scene)
    inputs = [scene, *([Path(told.surface.file)] if told.surface.file else [])]
    check_apart([output], inputs)
    if output is not None:
        output = check_output(output, overwrite)
    text = scene.read_text(encoding="utf-8")
    changes: dict[str, object] = {} if seed is None else {"seed": seed}
    if precision is not None:
        changes["precision"] = get_precision(precision).name
    told = told.model_copy(update=changes)
    try:
        setting = set_up(told, device=None if device is None else choose_device(device))
    except InputError as error:
        raise error if str(scene) in str(error) else InputError(f"{scene}: {error}") from error
    if check:
        print_surface_checks(setting.surface, np.unique(setting.nominal.theta_i), setting.wavelength)
    if rtol is not None:
        reduced = reduce_scene(setting, rtol)
        setting = reduced.setting
        for line in reduced.words:
            say(f"rtol {rtol:g}: {line}")
    if output is not None:
        options = {"precision": precision, "rtol": rtol, "seed": seed}
        made = made_by("simulate", inputs, options, {"seed": str(told.seed), **_provenance(setting)})
        with progress_bar("simulating") as report:
            done = stream(setting, output, text=text, provenance=made, overwrite=overwrite, report=report)
        _print_summary(output, setting, done)
        for name, (count, change) in setting.told.short.items():
            say(f"{name}: at {count} directions the highest order still changed the result by {change:.2g}")
    if ledger:
        with progress_bar("accounting") as report:
            account = keep_ledger(setting, report)
        _print_ledger(account)


def _provenance(setting: Setting) -> dict[str, str]:
    scene = setting.scene
    made = {"kind": "simulation, no measurement", "effects": ", ".join(scene.effects.on()) or "none"}
    if isinstance(setting.surface, ModelSurface):
        made["model"] = setting.surface.model.name
        made["precision"] = setting.surface.precision.name
        made["device"] = str(setting.surface.device)
    return made


def _print_summary(output: Path, setting: Setting, done: Streamed) -> None:
    wavelength = setting.wavelength
    ends = f"{wavelength[0]:g} nm" if len(wavelength) == 1 else f"{wavelength[0]:g} to {wavelength[-1]:g} nm"
    rows = [
        ["directions", str(len(setting.nominal))],
        ["wavelengths", f"{len(wavelength)}, {ends}"],
        ["effects", ", ".join(setting.scene.effects.on()) or "none"],
        ["values", f"{done.values}, {done.flagged} of them masked"],
        [
            "time",
            f"{done.seconds:.3g} s; {done.writing:.3g} s writing, {done.syncing:.2g} s to the disk",
        ],
    ]
    print_table(str(output), ("simulated", ""), rows, left=2)


def _print_ledger(ledger: Ledger) -> None:
    rows = [["surface", number(ledger.surface, 3), "", ""]]
    rows += [
        [entry.name, number(entry.seconds, 3), number(entry.largest, 3), number(entry.rms, 3)]
        for entry in ledger.effects.values()
    ]
    if ledger.counts:
        rows.append(["to counts and back", number(ledger.counts, 3), "", ""])
    rows.append(["sum of the parts", number(ledger.parts, 3), "", ""])
    rows.append(["the whole, timed beside them", number(ledger.whole, 3), "", ""])
    columns = ("part", "seconds added", "largest change", "rms change")
    print_table(f"ledger of {ledger.values} values; changes are relative", columns, rows)
    if not ledger.effects:
        say("no effects: the surface is all there is")
        return
    small = [e for e in ledger.effects.values() if e.largest < WORTH_A_WORD]
    if small:
        named = ", ".join(f"{e.name} ({e.largest:.2g}, saves {max(0.0, e.seconds):.2g} s)" for e in small)
        say(f"move no value by more than {WORTH_A_WORD:g}, and may be left out where that will do: {named}")
        say(f"--rtol {WORTH_A_WORD:g} leaves out what it can, and coarsens the rest")
    else:
        say(f"every effect moves some value by {WORTH_A_WORD:g} or more; none is to be left out unseen")
    costly = max(ledger.effects.values(), key=lambda e: e.seconds)
    say(f"{costly.name} costs most, {100 * costly.seconds / ledger.parts:.0f} % of the time")

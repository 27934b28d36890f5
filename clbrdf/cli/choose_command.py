"""`clbrdf choose`: which model describes this surface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.choose import RANKED_WAVELENGTHS, Choice, choose
from clbrdf.cli.choice_table import choice_content, print_choice
from clbrdf.cli.console import progress_bar, stderr_console
from clbrdf.cli.instrument import told_instrument
from clbrdf.cli.options import (
    DeviceName,
    JsonFile,
    Output,
    Overwrite,
    Seed,
    at_wavelengths,
    fix_words,
    fixed_map,
)
from clbrdf.errors import InputError
from clbrdf.fit import METHODS
from clbrdf.fit.weights_file import read_weights
from clbrdf.objective import WEIGHTS
from clbrdf.opencl.device import Device, choose_device
from clbrdf.scan import Scan
from clbrdf.storage.files import check_apart, check_output, sha256, whole_text
from clbrdf.storage.provenance import choose_options, made_by


def command(
    scan: Path,
    /,
    *,
    output: Output,
    models: str | None = None,
    weights: str | None = None,
    fix: Annotated[list[str], Parameter(negative_iterable="")] = [],  # noqa: B006 (cyclopts needs a list)
    wavelengths: str = str(RANKED_WAVELENGTHS),
    method: str = METHODS[0],
    seed: Seed = 0,
    through: Path | None = None,
    point: Annotated[bool, Parameter(negative="")] = False,
    force: Annotated[bool, Parameter(negative="")] = False,
    report: Annotated[Path | None, Parameter(help="also write the report into this folder")] = None,
    device: DeviceName = None,
    json: JsonFile = None,
    overwrite: Overwrite = False,
) -> None:
    """Compare models on a scan; print the ranking and write the fit of the model chosen.

    Each model is fitted to the scan, and again without each incident angle in turn, which it then has to
    predict. Chosen is the simplest whose mean squared deviation lies within one standard error of the lowest.

    Parameters
    ----------
    scan
        scan file; it needs three incident angles or more
    models
        names joined by commas, as in ggx+lambert,eon; "default" among them stands for the usual candidates,
        which are taken if none are named ('clbrdf models' lists what there is)
    weights
        none, relative (1/f²), sigma (1/σ² of the scan), or a CSV file as 'clbrdf fit' reads it; if not given,
        sigma where every value has an uncertainty, else relative
    fix
        name=value or name=FILE.csv (wavelength in nm, value): not fitted, in all models that have the
        parameter; as often as needed
    wavelengths
        how many of the scan's wavelengths the ranking is made at, or all
    method
        of the fits: auto, dictionary, lookup, anneal-separable, tempering or anneal
    seed
        of the random numbers
    through
        instrument file, as 'clbrdf fit' reads it; by default what the scan tells of its own
    point
        take every direction as a point, whatever the scan says
    force
        allow sums of whole surfaces, such as hapke+rpv
    """
    told_instrument(through, point)
    fixed = fixed_map(fix)
    spectra = [value for value in fixed.values() if isinstance(value, Path)]
    check_apart([output, json], [scan, *spectra, *([] if through is None else [through])])
    target = check_output(output, overwrite)
    if json is not None:
        check_output(json, overwrite)
    if report is not None and report.is_dir():
        from clbrdf.viz.report import FILES

        for name in FILES:
            check_output(report / name, overwrite)
    count = _count(wavelengths)
    measured, chosen_device = Scan.open(scan), choose_device(device)
    if report is not None and measured.bands:
        raise InputError(f"--report: a report draws over wavelengths, and {scan} has bands; leave it out")
    given = weights if weights is None or weights in WEIGHTS else read_weights(Path(weights), measured)
    with progress_bar("models compared") as progress:
        choice = choose(
            measured,
            models,
            weights=given,
            fix=at_wavelengths(fixed, measured),
            wavelengths=count,
            method=method,
            seed=seed,
            through=told_instrument(through, point),
            force=force,
            device=chosen_device,
            report=progress,
        )
    options = choose_options(
        models=models,
        weights=weights,
        fix=fix_words(fixed),
        wavelengths=wavelengths,
        method=method,
        seed=seed,
        force=force,
        through=None if through is None else through.name,
        point=point,
    )
    hashes = {f"spectrum_{k}_sha256": sha256(path) for k, path in enumerate(spectra)}
    hashes |= {} if through is None else {"through_sha256": sha256(through)}
    said = choice.weights if weights in (None, *WEIGHTS) else weights
    told = {**hashes, **choice.fit.provenance, "weights": said}
    choice = replace(choice, fit=replace(choice.fit, provenance=made_by("choose", [scan], options, told)))
    choice.save(target, overwrite)
    print_choice(str(target), choice)
    if json is not None:
        whole_text(json, choice_content(choice), overwrite)
    if report is not None:
        _write_report(choice, report, overwrite, chosen_device)


def _write_report(choice: Choice, folder: Path, overwrite: bool, device: Device) -> None:
    from clbrdf.viz.report import write_report

    with progress_bar("drawing the report") as progress:
        files, missing = write_report(choice.fit, folder, overwrite, device, progress, choice)
    told = stderr_console()
    for file in files:
        told.print(f"wrote {file}", soft_wrap=True)
    if missing:
        told.print(f"without lobes: {missing}", soft_wrap=True)


def _count(text: str) -> int | None:
    """Read how many wavelengths, None for all.

    Raises
    ------
    InputError
        Neither a whole number of 1 or more nor "all".
    """
    if text == "all":
        return None
    if not (text.isascii() and text.isdigit() and int(text) >= 1):
        raise InputError(f"--wavelengths {text!r}: give a whole number of 1 or more, or all")
    return int(text)

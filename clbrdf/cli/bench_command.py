"""`clbrdf bench`: measured here, now, beside peers."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from clbrdf.bench.accuracy import (
    CostPanel,
    fit_panel,
    integral_panel,
    objective_panel,
    some_wavelengths,
    value_panel,
)
from clbrdf.bench.figure import accuracy_figure
from clbrdf.bench.throughput import Contender, Start, contenders_on, measure_start, race
from clbrdf.cli.bench_batch import bench_batch
from clbrdf.cli.bench_choice import bench_choice
from clbrdf.cli.bench_coverage import bench_coverage
from clbrdf.cli.bench_fit import bench_fit
from clbrdf.cli.bench_grids import bench_grids
from clbrdf.cli.bench_models import bench_models_fit, bench_models_throughput, listed_models
from clbrdf.cli.bench_optimizers import (
    OptimizerOptions,
    bench_optimizers,
    bench_references,
    check_unused,
)
from clbrdf.cli.bench_planner import bench_planner
from clbrdf.cli.bench_scaling import bench_scaling
from clbrdf.cli.bench_through import bench_through
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.options import DeviceName, JsonFile, Overwrite
from clbrdf.errors import InputError
from clbrdf.models import DEFAULT_MODEL
from clbrdf.opencl.device import Device, choose_device
from clbrdf.parallel.ending import scratch_folder
from clbrdf.scan import Scan
from clbrdf.scans import sample_scan
from clbrdf.storage.files import check_apart, check_output, whole_text
from clbrdf.viz.curves import save_figure

FIT_WAVELENGTHS = 16


def command(
    what: Literal[
        "throughput",
        "accuracy",
        "grids",
        "optimizers",
        "fit",
        "scaling",
        "references",
        "choice",
        "planner",
        "coverage",
        "batch",
        "through",
    ],
    /,
    *,
    model: Annotated[
        str | None,
        Parameter(help="throughput, fit: a model, several (a,b+c) or all; optimizers: that of --scan"),
    ] = None,
    device: DeviceName = None,
    json: JsonFile = None,
    png: Annotated[Path | None, Parameter(help="accuracy, scaling, optimizers: also draw the tables")] = None,
    overwrite: Overwrite = False,
    scans: Annotated[int | None, Parameter(help="batch: how many scans")] = None,
    emulated: Annotated[
        bool, Parameter(help="planner: on emulated rigs, point by point, some 40 minutes", negative="")
    ] = False,
    options: Annotated[OptimizerOptions | None, Parameter(name="*")] = None,
) -> None:
    """Measure on this machine, now, in one run.

    Parameters
    ----------
    what
        throughput: million model evaluations a second in E (13), beside NumPy, Numba and C, interleaved;
        accuracy: error over time for model values, E, fits and integrals;
        grids: model values on grids of directions × wavelengths, scenes in memory and to a file;
        optimizers: nlopt, SciPy and our methods on a problem set, some minutes on two cores;
        fit: time and memory of whole fits of up to 2048 wavelengths beside peers, some minutes;
        scaling: time and memory of fits over directions and wavelengths, some minutes;
        references: the reference optima of that set, searched again;
        choice: how often 'clbrdf choose' and other rules find the model that made the data; --seeds;
        planner: points and seconds until a lobe's width is known, adaptive and uniform; --seeds, --emulated;
        through: bias and time of fits through an aperture, beside fits of points, a minute or two;
        batch: 'clbrdf batch' over 1, 2, … workers, and what a task costs; --scans, --wavelengths;
        coverage: how often 1σ of each parameter holds the truth, on made scans with common errors; --seeds
    """
    for output in (json, png):
        if output is not None:
            check_output(output, overwrite)
    check_apart([json, png], options.scan if options else [])
    if png is not None and what not in ("accuracy", "scaling", "optimizers"):
        raise InputError(f"--png: bench {what} draws no figure; bench accuracy, scaling and optimizers do")
    if what == "fit" and options is not None:
        check_unused(replace(options, full=False), what)
    elif what in ("choice", "planner", "coverage") and options is not None:
        check_unused(replace(options, seeds=None), what)
    elif what == "batch" and options is not None:
        check_unused(replace(options, wavelengths=None), what)
    elif what != "optimizers":
        check_unused(options, what)
    if scans is not None and what != "batch":
        raise InputError(f"--scans: bench {what} does not take it; it belongs to bench batch")
    if emulated and what != "planner":
        raise InputError(f"--emulated: bench {what} does not take it; it belongs to bench planner")
    if model is not None and what not in ("throughput", "fit", "optimizers"):
        raise InputError(f"--model: bench {what} does not take it; throughput, fit and optimizers do")
    chosen = choose_device(device)
    names = listed_models(model) if model is not None and what != "optimizers" else ()
    if what == "throughput" and names:
        content = bench_models_throughput(names, chosen)
    elif what == "fit" and len(names) > 1:
        content = bench_models_fit(names, chosen)
    elif what == "throughput":
        content = _throughput(chosen)
    elif what == "accuracy":
        content = _accuracy(chosen, png, overwrite)
    elif what == "optimizers":
        content = bench_optimizers(
            options or OptimizerOptions(), chosen, png, overwrite, model or DEFAULT_MODEL
        )
    elif what == "grids":
        content = bench_grids(chosen)
    elif what == "fit":
        content = bench_fit(chosen, bool(options and options.full), model or DEFAULT_MODEL)
    elif what == "scaling":
        content = bench_scaling(chosen, png, overwrite)
    elif what == "choice":
        content = bench_choice(chosen, options.seeds if options else None)
    elif what == "coverage":
        content = bench_coverage(chosen, options.seeds if options else None)
    elif what == "planner":
        content = bench_planner(options.seeds if options else None, emulated)
    elif what == "through":
        content = bench_through(chosen)
    elif what == "batch":
        content = bench_batch(scans, options.wavelengths if options else None)
    else:
        content = bench_references()
    if json is not None:
        whole_text(json, {"device": str(chosen), **content}, overwrite)


def _throughput(device: Device) -> dict[str, object]:
    with scratch_folder() as folder, progress_bar("rounds") as report:
        rows = race(contenders_on(device, folder), report=report)
    start = measure_start()
    print(f"{device}, {device.compute_units} units\n")
    for group in ("fp32", "fp64"):
        _print_group(group, [row for row in rows if row.group == group])
    text = [[name, f"{seconds:.2g}"] for name, seconds in _starts(start)]
    print_table("Before the first result", ("", "seconds"), text)
    return {
        "start": asdict(start),
        "throughput": [
            {"name": row.name, "group": row.group, "rate": row.rate, "seconds": list(row.seconds)}
            for row in rows
        ],
    }


def _starts(start: Start) -> list[tuple[str, float]]:
    return [("cold, caches empty", start.cold), ("warm", start.warm), ("one launch", start.launch)]


def _rate(rows: list[Contender], begin: str) -> float:
    return next((row.rate for row in rows if row.name.startswith(begin)), float("nan"))


def _print_group(group: str, rows: list[Contender]) -> None:
    if not rows:
        return
    c, ceiling = _rate(rows, "C,"), _rate(rows, "ceiling")
    text = [
        [
            row.name,
            f"{row.rate:.0f}",
            f"{row.rate / c:.2f}" if c == c else "–",
            f"{100 * row.rate / ceiling:.0f} %" if row.name.startswith("OpenCL") else "",
            f"{row.evaluations / min(row.seconds) / 1e6:.0f}",
        ]
        for row in rows
    ]
    title = f"E in {group}, million model evaluations a second"
    print_table(title, ("", "median", "× C", "ceiling", "best"), text)


def _accuracy(device: Device, png: Path | None, overwrite: bool) -> dict[str, object]:
    scan = some_wavelengths(Scan.open(sample_scan("yellow_tin_foil")), FIT_WAVELENGTHS)
    with progress_bar("fits") as report:
        fits = fit_panel(device, scan, report)
    panels = [value_panel(device), objective_panel(device), fits, integral_panel(device)]
    print(f"{device}, {device.compute_units} units\n")
    for panel in panels:
        _print_panel(panel)
    if png is not None:
        save_figure(accuracy_figure(panels, str(device)), png, overwrite)
    return {"accuracy": [asdict(panel) for panel in panels]}


def _print_panel(panel: CostPanel) -> None:
    rows = [[p.series, p.name, f"{p.seconds:.2e}", f"{p.error:.1e}", p.note] for p in panel.points]
    print_table(panel.title, ("", "", panel.work, panel.error, ""), rows, left=2)

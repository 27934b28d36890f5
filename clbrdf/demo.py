"""The main job end to end: a measurement, its fit at every wavelength, a table and pictures."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.fit import Fit, fit
from clbrdf.optimizers.check import check_fit, sample_places
from clbrdf.parallel.executor import usable_cores
from clbrdf.parallel.processes import pool
from clbrdf.progress import Report
from clbrdf.rig.demo_scan import measure_demo_scan
from clbrdf.scan import Scan
from clbrdf.viz import demo_pictures
from clbrdf.viz.curves import measured_and_model, save_figure, spectral_map

CHECKED = 4
"""Wavelengths that other optimizers search again; about a second each."""


@dataclass(frozen=True)
class DemoStep:
    """One step of the demo: what it did, the files it left in the folder, wall seconds."""

    name: str
    files: str
    seconds: float


def demo(folder: Path, overwrite: bool, report: Report) -> tuple[Fit, list[DemoStep], list[str]]:
    """Run the demo into a folder, which is made if it does not exist; return fit, steps, what is missing.

    An emulated rig measures the yellow tin foil of `scans/` over pseudo-terminals; the scan is fitted
    with its own uncertainties as weights, and a few wavelengths are checked by other optimizers. Where
    OpenGL is missing, the pictures that need it are left out, and a line says so.

    Raises
    ------
    InputError
        A file of the demo exists and `overwrite` is False, or the folder cannot be made.
    DeviceError
        No OpenCL device.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}); name another with -o") from error
    steps: list[DemoStep] = []
    began = time.perf_counter()

    def done(name: str, files: str) -> None:
        nonlocal began
        now = time.perf_counter()
        steps.append(DemoStep(name, files, now - began))
        began = now

    scan = Scan.open(measure_demo_scan(folder / "scan.h5", report, overwrite))
    done(f"measure {len(scan.theta_i)} directions on an emulated rig", "scan.h5")
    result = fit(scan, weights="sigma", report=report)
    result.save(folder / "fit.h5", overwrite)
    done(f"fit {len(scan.wavelength)} wavelengths", "fit.h5")
    with pool(usable_cores()) as executor:
        verdicts = check_fit(result, sample_places(result, CHECKED), executor=executor, report=report)
    agreed = sum(verdict.word != "worse" for verdict in verdicts)
    done(f"search {len(verdicts)} of them again with two other optimizers: {agreed} at the optimum", "")
    save_figure(measured_and_model(result), folder / "curves.png", overwrite)
    done("draw measured against model (Figs. 9-11)", "curves.png")
    save_figure(spectral_map(result), folder / "spectrum.png", overwrite)
    done("draw BRDF over wavelength and angle (Fig. 5)", "spectrum.png")
    files, missing = demo_pictures(result, folder, overwrite)
    done("draw lobes, the page that computes, the report", ", ".join(file.name for file in files))
    return result, steps, missing

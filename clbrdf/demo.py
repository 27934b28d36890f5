"""The main job end to end: a scan, its fit at every wavelength, a table and pictures."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from clbrdf.errors import InputError
from clbrdf.fit import Fit, fit
from clbrdf.progress import Report
from clbrdf.scan import Scan
from clbrdf.scans import sample_scan
from clbrdf.viz.curves import measured_and_model, save_figure, spectral_map


@dataclass(frozen=True)
class Stage:
    """One stage of the demo: what it did, the file it left, wall seconds."""

    name: str
    file: Path
    seconds: float


def demo(folder: Path, overwrite: bool, report: Report) -> tuple[Fit, list[Stage]]:
    """Run the demo into a folder, which is made if it does not exist.

    Fits the synthetic yellow tin foil with the scan's own uncertainties as weights.

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
    stages: list[Stage] = []
    began = time.perf_counter()

    def done(name: str, file: str) -> None:
        nonlocal began
        now = time.perf_counter()
        stages.append(Stage(name, folder / file, now - began))
        began = now

    scan = Scan.open(sample_scan("yellow_tin_foil"))
    scan.save(folder / "scan.h5", overwrite)
    done("copy the sample scan", "scan.h5")
    result = fit(scan, weights="sigma", report=report)
    result.save(folder / "fit.h5", overwrite)
    done(f"fit {len(scan.wavelength)} wavelengths", "fit.h5")
    save_figure(measured_and_model(result), folder / "curves.png", overwrite)
    done("draw measured against model (Figs. 9-11)", "curves.png")
    save_figure(spectral_map(result), folder / "spectrum.png", overwrite)
    done("draw BRDF over wavelength and angle (Fig. 5)", "spectrum.png")
    return result, stages

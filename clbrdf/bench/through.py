"""What a fit of points makes of values seen through an aperture, and what a fit through it makes of them.

Scenes integrate over the aperture to 1e-7. No noise is added, so that what parameters are off by is bias;
the fit is told 0.2 % of each value for its standard uncertainty, and the bias is given in units of the
parameters' own.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit import Fit, fit
from clbrdf.geometry import Directions
from clbrdf.instrument.aperture import Aperture
from clbrdf.instrument.settings import Instrument
from clbrdf.models import get_model
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan
from clbrdf.scene import simulate
from clbrdf.scene.scenefile import Scene

Array = npt.NDArray[np.float64]

NOISE = 0.002
"""Standard uncertainty that the fits are told, as a share of each value."""

RATIOS = (0.1, 0.3, 0.5, 1.0, 2.0)
"""R/w: half-angle of the aperture over the half-width of the lobe at half its height."""

SURFACES: dict[str, dict[str, float]] = {
    "ggx+lambert": {"ggx.alpha": 0.03, "ggx.F0": 0.1, "ggx.F90": 1.0, "lambert.rho": 0.3},
    "abg+lambert": {"abg.b0": 20.0, "abg.x_k": 0.03, "abg.g": 1.7, "lambert.rho": 0.3},
    "wang2013": {"a": 3.87, "b": 0.5216, "c": -600.0, "d": 0.74, "ks": 451.8, "kd": 1.3034},
}
"""Models and their parameters; their sharpest lobes are 1° to 2° wide."""

FIXED: dict[str, dict[str, float]] = {"ggx+lambert": {"ggx.F90": 1.0}}
"""What is not fitted."""

INCIDENT = (20.0, 40.0, 60.0)
WAVELENGTHS = 77
REPEATS = 3


@dataclass(frozen=True)
class BiasRow:
    """One surface behind one aperture.

    Attributes
    ----------
    model : str
    ratio : float
        R/w.
    angle : float
        Full angle of the aperture, degrees.
    nodes : float
        Of a direction, on average.
    bias_point, bias_through : float
        The largest of all parameters and wavelengths, in units of its standard uncertainty.
    milliseconds_point, milliseconds_through : float
        Of all cores' time for a wavelength, the least of some repeats.
    """

    model: str
    ratio: float
    angle: float
    nodes: float
    bias_point: float
    bias_through: float
    milliseconds_point: float
    milliseconds_through: float


def half_width(name: str) -> float:
    """Half-width of a surface's lobe at half its height, degrees of view zenith, at θi = 40°."""
    model = get_model(name)
    theta = np.linspace(40.0, 60.0, 20001)
    parameters = model.vector(SURFACES[name])[None, :]
    values = model.brdf(parameters, model.features(Directions.relative(40.0, theta, 180.0)))
    return float(theta[np.argmax(values < values[0] / 2.0)] - 40.0)


def seen_scan(name: str, angle: float, wavelengths: int, device: Device | None = None) -> Scan:
    """Return what an aperture sees of a surface whose parameters drift with wavelength by a percent."""
    drift = {"polynomial": [1.0, 0.01], "centre": 550.0, "scale": 150.0}
    curves = {
        key: {**drift, "polynomial": [value, 0.01 * value]} if key not in FIXED.get(name, {}) else value
        for key, value in SURFACES[name].items()
    }
    scene = Scene.model_validate(
        {
            "surface": {"model": name, "parameters": curves},
            "directions": {
                "theta_i": list(INCIDENT),
                "theta_r": {"start": 0.0, "stop": 75.0, "step": 1.0},
                "phi_r": 180.0,
            },
            "wavelength": np.linspace(400.0, 700.0, wavelengths).tolist(),
            "effects": {"aperture": {"angle": angle}} if angle else {},
            "rtol": 1e-7,
        }
    )
    scan = simulate(scene, device=device)
    return replace(scan, sigma=NOISE * scan.brdf)


def bias(result: Fit, name: str) -> float:
    """Largest distance of a fitted parameter from the truth, in units of its standard uncertainty."""
    turn = 1.0 + 0.01 * (result.wavelength - 550.0) / 150.0
    off = [
        np.abs(result.parameters[key] - value * turn) / result.sigma[key]
        for key, value in SURFACES[name].items()
        if key not in result.given
    ]
    return float(np.max(off))


def fit_both_ways(
    name: str, ratio: float, wavelengths: int, repeats: int, device: Device | None = None
) -> BiasRow:
    """Fit one surface behind one aperture, as points and through it."""
    angle = 2.0 * ratio * half_width(name)
    scan = seen_scan(name, angle, wavelengths, device)
    ways: dict[str, str | Instrument] = {
        "point": "point",
        "through": Instrument(aperture=Aperture(angle=angle)),
    }
    results: dict[str, Fit] = {}
    spent = dict.fromkeys(ways, np.inf)
    for k in range(repeats + 1):
        for way, told in ways.items():
            start = time.process_time()
            results[way] = fit(
                scan, model=name, weights="sigma", fix=FIXED.get(name, {}), through=told, device=device
            )
            if k:  # the first builds the kernels
                spent[way] = min(spent[way], time.process_time() - start)
    return BiasRow(
        model=name,
        ratio=ratio,
        angle=angle,
        nodes=len(results["through"].observation.nodes) / len(scan),
        bias_point=bias(results["point"], name),
        bias_through=bias(results["through"], name),
        milliseconds_point=1e3 * spent["point"] / wavelengths,
        milliseconds_through=1e3 * spent["through"] / wavelengths,
    )


def run(
    device: Device | None = None,
    names: Sequence[str] = tuple(SURFACES),
    ratios: Sequence[float] = RATIOS,
    wavelengths: int = WAVELENGTHS,
    repeats: int = REPEATS,
    report: Report = silent,
) -> list[BiasRow]:
    """Return a row for each surface and each aperture."""
    pairs = [(name, ratio) for name in names for ratio in ratios]
    rows = []
    for k, (name, ratio) in enumerate(pairs):
        rows.append(fit_both_ways(name, ratio, wavelengths, repeats, device))
        report(k + 1, len(pairs))
    return rows

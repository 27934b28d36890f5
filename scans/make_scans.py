"""Make the synthetic sample scans from Table 1 of Wang, Zhang and Dong (2013).

    python scans/make_scans.py

The paper gives one parameter set a material. Here each parameter follows a smooth curve in wavelength
that passes through its Table 1 value at 570 nm, the middle of 380-760 nm; with t = (λ − 570 nm) / 190 nm:

    yellow tin foil      a = a₁ (1 + 0.04 t)          b = b₁ (1 + 0.02 t)      c = c₁ (1 − 0.10 t)
                         d = d₁ (1 + 0.02 t)          kd = kd₁ (1 + 0.30 t)
                         ks = ks₁ (1 + 0.45 tanh(3 (λ − 520 nm) / 100 nm)) / (1 + 0.45 tanh 1.5)
    black ceramic tile   as above with half the slopes, ks = ks₁ (1 + 0.05 t)

(the foil is yellow: it reflects little below about 500 nm). Directions are the paper's: θi = 30, 45, 60°,
θr = 0-85° in steps of 1°, φ = 180°, 380-760 nm in steps of 2.4 nm. Each value is multiplied by
1 + 0.0605 z, z standard normal from the stated seed: the paper's total uncertainty (7); the scan's
uncertainties are 6.05 % of the noise-free values.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf import Scan, evaluate

Array = npt.NDArray[np.float64]

RELATIVE_SIGMA = 0.0605
WAVELENGTH: Array = 380.0 + 2.4 * np.arange(159, dtype=np.float64)
INCIDENT: Array = np.array([30.0, 45.0, 60.0])
VIEW: Array = np.arange(86, dtype=np.float64)
TABLE_1 = {
    "yellow_tin_foil": {"a": 3.87, "b": 0.5216, "c": -300.0, "d": 0.74, "ks": 451.7958, "kd": 1.3034},
    "black_ceramic_tile": {"a": 7.9678, "b": 0.5555, "c": -180.0, "d": 0.74, "ks": 190.5, "kd": 1.8667},
}
SEEDS = {"yellow_tin_foil": 20131, "black_ceramic_tile": 20132}


def parameter_curves(material: str, wavelength: Array) -> dict[str, Array]:
    """Return the parameters of a material over wavelength (nm), as in the module's table."""
    t = (wavelength - 570.0) / 190.0
    foil = material == "yellow_tin_foil"
    slope = 1.0 if foil else 0.5
    yellow = (1.0 + 0.45 * np.tanh(3.0 * (wavelength - 520.0) / 100.0)) / (1.0 + 0.45 * np.tanh(1.5))
    factors = {
        "a": 1.0 + 0.04 * slope * t,
        "b": 1.0 + 0.02 * slope * t,
        "c": 1.0 - 0.10 * slope * t,
        "d": 1.0 + 0.02 * slope * t,
        "ks": yellow if foil else 1.0 + 0.05 * t,
        "kd": 1.0 + 0.30 * slope * t,
    }
    return {name: TABLE_1[material][name] * factor for name, factor in factors.items()}


def make_scan(material: str) -> Scan:
    """Return the synthetic scan of a material."""
    theta_i = np.repeat(INCIDENT, len(VIEW))
    theta_r = np.tile(VIEW, len(INCIDENT))
    truth = evaluate(parameter_curves(material, WAVELENGTH), theta_i, theta_r, 180.0)
    noise = np.random.default_rng(SEEDS[material]).standard_normal(truth.shape)
    return Scan(
        theta_i=theta_i,
        phi_i=np.zeros(1),
        theta_r=theta_r,
        phi_r=np.full(1, 180.0),
        wavelength=WAVELENGTH,
        brdf=truth * (1.0 + RELATIVE_SIGMA * noise),
        sigma=RELATIVE_SIGMA * truth,
        sample=f"{material.replace('_', ' ')} (SYNTHETIC)",
        instrument="none: synthetic, from Table 1 of Wang, Zhang and Dong (2013)",
        provenance={
            "kind": "synthetic scan, no measurement",
            "made_by": "scans/make_scans.py",
            "seed": str(SEEDS[material]),
            "noise": f"{100 * RELATIVE_SIGMA:g} % of each value, normal, independent",
            "table_1": ", ".join(f"{name}={value:g}" for name, value in TABLE_1[material].items()),
        },
    )


def main() -> None:
    """Write one file a material."""
    parser = argparse.ArgumentParser(description="Make the synthetic sample scans.")
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent, help="folder to write to")
    folder = parser.parse_args().output
    for material in TABLE_1:
        make_scan(material).save(folder / f"{material}.h5", overwrite=True)


if __name__ == "__main__":
    main()

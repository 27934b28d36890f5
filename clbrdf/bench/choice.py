"""How often a rule finds the model that made the data, with and without a smooth systematic error.

The truth is GGX + Lambert; candidates are Beckmann, GGX and two GGX, each with Lambert. Noise of 1 % is
independent from value to value, and the stated uncertainty is that of the noise alone. The systematic error
is what alignment, stray light and non-linearity leave in real scans: a factor

    1 + s u(θi, θr),    u ∝ Σ ± P_a(x_i) P_b(x_r)

of Legendre polynomials of low order with signs drawn at random, x_i and x_r the incident and the signed view
zenith brought to [−1, 1], u scaled to a root mean square of 1 over the scan. It is the same at all
wavelengths, as an error of the geometry is, and no model has it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from clbrdf.choose import Choice, choose
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

TRUTH = "ggx+lambert"
CANDIDATES = ("beckmann+lambert", TRUTH, "ggx+ggx+lambert")
SYSTEMATIC = (0.0, 0.005, 0.02)
NOISE = 0.01
SEEDS = 20

INCIDENT = (10.0, 25.0, 40.0, 55.0, 70.0)
VIEW = np.arange(-80.0, 80.1, 2.5)
"""Signed: positive forward."""

WAVELENGTHS = (450.0, 550.0, 650.0)

TERMS = ((1, 0), (2, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2))
"""Orders a and b of the polynomials."""

RULES: dict[str, Callable[[Choice], str]] = {
    "AICc": lambda choice: min(choice.ranking, key=lambda row: row.aicc).model,
    "BIC": lambda choice: min(choice.ranking, key=lambda row: row.bic).model,
    "left-out angles, lowest": lambda choice: choice.best.model,
    "left-out angles, one standard error": lambda choice: choice.chosen,
}

LEAD = "left-out angles, one standard error"
"""Of RULES the one that `choose` follows."""


@dataclass(frozen=True)
class TrialOutcome:
    """What came out of one made scan.

    Attributes
    ----------
    seed : int
    systematic : float
        Root mean square, relative.
    picked : dict of str to str
        The model that each of RULES picks.
    no_model_fits : bool
        Whether `choose` says so.
    chi2_reduced : float
        Lowest of the models.
    """

    seed: int
    systematic: float
    picked: dict[str, str]
    no_model_fits: bool
    chi2_reduced: float


def made_scan(seed: int, systematic: float) -> Scan:
    """Return a scan of GGX + Lambert with noise of 1 % and a systematic error.

    Surface, noise and signs follow from the seed: the same at every size of the systematic error.
    """
    surface, noise, signs = (np.random.default_rng([seed, k]) for k in range(3))
    theta_i = np.repeat(INCIDENT, len(VIEW))
    signed = np.tile(VIEW, len(INCIDENT))
    phi = np.where(signed < 0.0, 0.0, 180.0)
    directions = Directions.relative(theta_i, np.abs(signed), phi)
    model = get_model(TRUTH)
    alpha = np.exp(surface.uniform(np.log(0.1), np.log(0.4)))
    shape = {"ggx.alpha": alpha, "ggx.F90": 1.0}
    spectra = {
        "ggx.F0": surface.uniform(0.03, 0.1) * np.linspace(1.0, 1.2, len(WAVELENGTHS)),
        "lambert.rho": surface.uniform(0.05, 0.4) * np.linspace(0.7, 1.3, len(WAVELENGTHS)),
    }
    vector = model.vector({**shape, **spectra})
    exact = model.brdf(vector[:, None, :], model.features(directions)).T
    field = systematic_field(theta_i, signed, signs)
    measured = exact * (1.0 + systematic * field[:, None])
    measured *= 1.0 + NOISE * noise.standard_normal(exact.shape)
    zero, wavelength = np.zeros(1), np.array(WAVELENGTHS)
    sigma = NOISE * measured
    return Scan(theta_i, zero, np.abs(signed), phi, wavelength, measured, sigma=sigma, sample="made")


def systematic_field(theta_i: Array, signed: Array, random: np.random.Generator) -> Array:
    """Return u (N,), smooth over θi and signed θr, root mean square 1."""
    x_i = 2.0 * (theta_i - theta_i.min()) / np.ptp(theta_i) - 1.0
    x_r = signed / np.abs(signed).max()
    field = np.zeros_like(theta_i)
    for a, b in TERMS:
        sign = random.choice([-1.0, 1.0])
        field += sign * _legendre(a, x_i) * _legendre(b, x_r)
    return np.asarray(field / np.sqrt((field**2).mean()))


def _legendre(order: int, x: Array) -> Array:
    return np.asarray(legendre.legval(x, np.eye(order + 1)[order]))


def run(
    device: Device,
    seeds: Sequence[int] = range(SEEDS),
    systematic: Sequence[float] = SYSTEMATIC,
    report: Report = silent,
) -> list[TrialOutcome]:
    """Choose on made scans, one for each seed and size of the systematic error."""
    out: list[TrialOutcome] = []
    total = len(seeds) * len(systematic)
    for size in systematic:
        for seed in seeds:
            report(len(out), total)
            choice = choose(made_scan(seed, size), CANDIDATES, weights="sigma", device=device)
            picked = {name: rule(choice) for name, rule in RULES.items()}
            lowest = min(row.chi2_reduced for row in choice.ranking)
            out.append(TrialOutcome(seed, size, picked, not choice.fits, lowest))
    report(total, total)
    return out


def truths(outcomes: Sequence[TrialOutcome], systematic: float, rule: str) -> int:
    """Count how often a rule picked the truth at one size of the systematic error."""
    return sum(o.picked[rule] == TRUTH for o in outcomes if o.systematic == systematic)


def refusals(outcomes: Sequence[TrialOutcome], systematic: float) -> int:
    """Count how often `choose` said that no model fits."""
    return sum(o.no_model_fits for o in outcomes if o.systematic == systematic)

"""The problem set for optimizers and for our own methods: small synthetic scans, each hard in one way.

Deterministic, in NumPy fp64: values of the model times 1 + noise z, z standard normal from a seed made of
the problem's name. The true parameters change from wavelength to wavelength and stand away from the middle of
the box (b from 0.5, a from 0 and so on), because some optimizers look there first. Noise moves the optimum
off the truth; where it lies is told by the references (references.py).

Without noise the optimum is E = 0 and no gap relative to it exists; see clbrdf.optimizers.gap.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

SPREAD = 0.08
"""How far parameters move over the wavelengths of one problem, relative."""


@dataclass(frozen=True)
class Recipe:
    """How one problem is made.

    Attributes
    ----------
    name, hard : str
        What it is called and what is hard about it.
    incident : tuple of float
        θi, degrees.
    view : (float, float, float)
        θr from, to, step, degrees.
    azimuths : tuple of float
        φ, degrees.
    noise : float
        Relative standard deviation of each value.
    wavelengths : int
    parameters : mapping of str to float
        Truth at the middle wavelength; Table 1's tin foil where not named.
    """

    name: str
    hard: str
    noise: float
    incident: tuple[float, ...] = (30.0, 45.0, 60.0)
    view: tuple[float, float, float] = (0.0, 80.0, 2.0)
    azimuths: tuple[float, ...] = (180.0,)
    wavelengths: int = 3
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class BenchProblem:
    """A scan to fit, what is hard about it, and with what model: its name, and what is not fitted of it."""

    name: str
    hard: str
    scan: Scan
    model: str = DEFAULT_MODEL
    fix: Mapping[str, float] = field(default_factory=dict)


FOIL = {"a": 3.87, "b": 0.62, "c": -300.0, "d": 0.74, "ks": 451.7958, "kd": 1.3034}
TILE = {"a": 7.9678, "b": 0.5555, "c": -180.0, "d": 0.74, "ks": 190.5, "kd": 1.8667}

RECIPES = (
    Recipe("foil-exact", "no noise: E falls to rounding", 0.0, parameters=FOIL),
    Recipe("foil-1", "tin foil, 1 % noise", 0.01, parameters=FOIL),
    Recipe("foil-6", "tin foil, 6 % noise", 0.06, parameters=FOIL),
    Recipe("tile-10", "ceramic tile, 10 % noise", 0.10, parameters=TILE),
    Recipe(
        "one-angle",
        "one incident angle: ks, a and b cannot be told apart",
        0.03,
        incident=(40.0,),
        view=(0.0, 84.0, 1.0),
        parameters={"c": -120.0, "d": 0.85, "ks": 12.0, "kd": 0.4},
    ),
    Recipe(
        "two-angles",
        "two incident angles: a valley in ks, a and b",
        0.03,
        incident=(25.0, 55.0),
        parameters={"c": -150.0, "d": 0.8, "ks": 80.0, "kd": 0.8},
    ),
    Recipe(
        "six-angles",
        "six incident angles, which pull on one quadratic",
        0.05,
        incident=(10.0, 25.0, 40.0, 50.0, 60.0, 70.0),
        parameters={"a": 6.1, "b": 0.73, "c": -95.0, "d": 0.66, "ks": 22.0, "kd": 0.9},
    ),
    Recipe(
        "narrow",
        "a lobe 1° wide, met by few directions",
        0.04,
        view=(0.0, 80.0, 1.0),
        parameters={"a": 2.2, "b": 0.81, "c": -2500.0, "d": 0.79, "ks": 700.0, "kd": 0.3},
    ),
    Recipe(
        "broad",
        "a lobe 60° wide, hardly told from the diffuse term",
        0.04,
        incident=(20.0, 40.0, 60.0),
        parameters={"a": -3.1, "b": 0.27, "c": -7.5, "d": 1.15, "ks": 0.6, "kd": 0.11},
    ),
    Recipe(
        "weak",
        "a weak lobe in noise: wrong lobes fit nearly as well",
        0.05,
        incident=(20.0, 40.0, 60.0),
        parameters={"a": 1.3, "b": 0.3, "c": -60.0, "d": 0.9, "ks": 0.12, "kd": 1.1},
    ),
    Recipe(
        "at-bounds",
        "d and kd at or near their limits",
        0.02,
        parameters={"a": 17.5, "b": 0.66, "c": -4000.0, "d": 1.97, "ks": 35.0, "kd": 9.8},
    ),
    Recipe(
        "no-diffuse",
        "kd thousands of times below the lobe: flat in its logarithm",
        0.08,
        incident=(15.0, 35.0, 65.0),
        parameters={"a": -6.4, "b": 0.93, "c": -45.0, "d": 0.58, "ks": 150.0, "kd": 2e-4},
    ),
    Recipe(
        "two-basins",
        "ln F nearly straight in cosθi: two minima, b on either side, 1 to 3 % apart",
        0.03,
        incident=(10.0, 30.0, 50.0, 70.0),
        view=(0.0, 80.0, 3.0),
        wavelengths=4,
        parameters={"a": 0.6, "b": 2.0, "c": -32.0, "d": 0.87, "ks": 0.05, "kd": 0.05},
    ),
    Recipe(
        "hemisphere",
        "four incident angles, out of the plane, 7 % noise",
        0.07,
        incident=(10.0, 30.0, 50.0, 70.0),
        view=(0.0, 75.0, 7.5),
        azimuths=(0.0, 45.0, 90.0, 135.0, 165.0, 180.0),
        parameters={"a": 4.6, "b": 0.41, "c": -22.0, "d": 0.93, "ks": 3.5, "kd": 0.06},
    ),
)
"""The set, in the order of tables."""


def problem_set(names: tuple[str, ...] = ()) -> tuple[BenchProblem, ...]:
    """Return the problems of the set, all of them or those named.

    Raises
    ------
    InputError
        An unknown name.
    """
    known = {recipe.name: recipe for recipe in RECIPES}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"no problem is called {unknown[0]!r}; there are {', '.join(known)}")
    return tuple(make(known[name]) for name in names or known)


def make(recipe: Recipe) -> BenchProblem:
    """Return the problem of a recipe, the same each time."""
    model = get_model()
    first, last, step = recipe.view
    view = np.arange(first, last + 0.5 * step, step)
    theta_i, phi, theta_r = (
        grid.ravel() for grid in np.meshgrid(recipe.incident, recipe.azimuths, view, indexing="ij")
    )
    zero = np.zeros(1)
    wavelength = np.linspace(450.0, 650.0, recipe.wavelengths)
    empty = Scan(theta_i, zero, theta_r, phi, wavelength, np.ones((len(theta_i), recipe.wavelengths)))
    rng = np.random.default_rng(zlib.crc32(recipe.name.encode()))
    centre = model.vector(recipe.parameters)
    truth = centre * (1.0 + SPREAD * rng.uniform(-1.0, 1.0, (recipe.wavelengths, len(centre))))
    limits = model.bounds()
    truth = np.clip(truth, limits[:, 0], limits[:, 1])
    exact = model.brdf(truth[:, None, :], model.features(empty.directions)).T
    values = exact * (1.0 + recipe.noise * rng.standard_normal(exact.shape))
    return BenchProblem(
        recipe.name,
        recipe.hard,
        Scan(
            theta_i,
            zero,
            theta_r,
            phi,
            wavelength,
            values,
            sigma=recipe.noise * exact if recipe.noise else None,
            sample=f"{recipe.name} (SYNTHETIC)",
            instrument=f"none: synthetic, {recipe.hard}",
            provenance={"kind": "synthetic scan, no measurement", "made_by": "clbrdf.bench.problems"},
        ),
    )

"""Every optimum: fits of every model and of six sums end at the best of many restarts of another solver.

Made scans carry noise, and come from the model itself and from others; coatings, one made and the real ones,
come from none of them.
The long part prints for each model how many optima were found and how many starts agreed.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from zlib import crc32

import numpy as np
import pytest

import clbrdf
from clbrdf import Scan
from clbrdf.formats.load import load_one
from clbrdf.models import NEEDS_PHI, get_model
from tests.coating import made_coating
from tests.conftest import COATINGS
from tests.models.test_every_model import MODELS
from tests.reference.restarts import restarts

FOUND = 1e-6
"""Relative excess of E over the best of the restarts up to which an optimum counts as found."""

EXACT = 1e-24
"""E below this is rounding."""

NOISE = 0.02
FLOOR = 1e-5
"""1/sr, below which no instrument sees: stray light and dark signal."""

OTHERS = ("ggx+minnaert", "wang2013", "ross_li")

OPTICAL = {"n": 1.5, "k": 0.5}
"""Constants that a fit has to be told."""


def told(model):
    """Values of the parameters that a fit of the model has to be told."""
    return {row.name: OPTICAL[row.name.split(".")[-1]] for row in model.parameters if row.given == "user"}


def directions(turned):
    """144 pairs in three half-planes; with several incident azimuths where the surface has a direction."""
    theta_i, theta_r, phi = (
        a.ravel()
        for a in np.meshgrid(
            [10.0, 30.0, 50.0, 70.0], np.linspace(0.0, 77.0, 12), [0.0, 90.0, 180.0], indexing="ij"
        )
    )
    phi_i = 40.0 * (np.arange(len(phi)) % 3) if turned else np.zeros(len(phi))
    return clbrdf.Directions(theta_i, phi_i, theta_r, phi_i + phi)


def truth(name, rng):
    """Parameters of a model in the middle of its domain; values there are those of surfaces."""
    model = get_model(name)
    out = {}
    for row in model.parameters:
        if row.given:
            out[row.name] = OPTICAL.get(row.name.split(".")[-1], 550.0)
            continue
        low, high = np.sort(row.to_coordinate(np.array(row.bounds)))
        share = rng.uniform(0.3, 0.7)
        if row.linear:  # the middle of ks or b0 may be far from any surface
            out[row.name] = min(row.default * rng.uniform(0.3, 1.5), high)
        else:
            out[row.name] = float(row.from_coordinate(low + share * (high - low)))
    return model.vector(out)


def made(name, wavelengths, seed):
    """A noisy scan: two of three wavelengths from the model itself, every third one from another."""
    rng = np.random.default_rng([seed, crc32(name.encode())])
    d = directions(bool(get_model(name).flags & NEEDS_PHI))
    columns = []
    for k in range(wavelengths):
        source = name if k % 3 < 2 else OTHERS[k // 3 % len(OTHERS)]
        model = get_model(source)
        f = model.brdf(truth(source, rng)[None], model.features(d))
        columns.append((np.abs(f) + FLOOR) * (1.0 + NOISE * rng.standard_normal(len(f))))
    nm = 500.0 + 10.0 * np.arange(wavelengths)
    return Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, nm, np.stack(columns, axis=1))


def fitted(scan, name):
    model = get_model(name)
    return clbrdf.fit(scan, model=name, weights="relative", fix=told(model))


def reference(job):
    """E at the ends of the restarts at one wavelength."""
    name, scan, k, g, bounds, given, count = job
    good = g > 0.0
    return restarts(get_model(name), scan.directions[good], scan.brdf[good, k], g[good], bounds, given, count)


def jobs_of(fit, name, count):
    return [
        (
            name,
            fit.scan,
            k,
            fit.setup.weights[:, k],
            fit.setup.bounds,
            {given: float(fit.parameters[given][k]) for given in fit.given},
            count,
        )
        for k in range(len(fit.wavelength))
    ]


def excess(found, best):
    """Relative excess of E over the best of the restarts; 0 where both are rounding."""
    return np.where(found <= EXACT, 0.0, (found - best) / np.maximum(best, EXACT))


@pytest.mark.parametrize("name", MODELS)
def test_made_scans_end_at_the_best_of_8_restarts(name):
    fit = fitted(made(name, 3, seed=1), name)
    best = np.array([reference(job)[0] for job in jobs_of(fit, name, 8)])
    assert (excess(fit.objective, best) <= FOUND).all()


def test_the_made_coating_is_as_hard_as_real_ones_and_its_optimum_is_found():
    """Few starts find the optimum, and others end elsewhere: what a fit has to be proof against."""
    fit, least = clbrdf.fit(made_coating().columns([0, 1])), []
    for k, job in enumerate(jobs_of(fit, "wang2013", 30)):
        ends = reference(job)
        assert excess(fit.objective[k], ends[0]) <= FOUND
        least.append(np.mean(ends <= ends[0] * (1.0 + FOUND)))
        # The real coatings have 2 to 6 ends that are no rounding of one another.
        assert np.count_nonzero(np.diff(ends) > 1e-3 * ends[:-1]) >= 2
    # Of the real coatings 30 to 57 % of random starts end at the best.
    assert max(least) <= 0.57


SAMPLES = {
    "black_coatings_in_plane.csv": (
        *("nite_on_invar", "opticalblackanodize_on_al", "titaniumanodize_on_ti", "z307_on_al"),
    ),
    "black_coatings_hemisphere_650nm.csv": (
        *("AnoBlackEC1onAlum", "AnoBlackEC2onAlum", "AnoBlackNiTEonINVAR", "AnoBlackNiTEonSteel"),
    ),
}
MISSED = {
    "abg+abg+lambert": (1, 3e-6),  # a second minimum of two terms that are nearly alike
    "beckmann_conductor": (1, 4e-3),  # kinks of total reflection at k = 0, where the model is off by E = 0.9
    "wang2013": (1, 6e-4),  # ks = 2e-24 under exp(20): below the floor that stands for 0
}
"""Optima of the long part that are known to be missed: how many of 28 or 32, and by how much at most in E."""

SOAK_WAVELENGTHS = int(os.environ.get("W", 12))
RESTARTS = 60


@pytest.mark.soak
@pytest.mark.parametrize("name", MODELS)
def test_made_scans_and_coatings_end_at_the_best_of_60_restarts(name):
    scans = [made(name, SOAK_WAVELENGTHS, seed=2), made_coating()]
    if COATINGS.is_dir():
        scans += [load_one([COATINGS / file], sample) for file, names in SAMPLES.items() for sample in names]
    else:
        print("without the real coatings (../shared/data), which are not on this machine")
    fits = [fitted(scan, name) for scan in scans]
    jobs = [job for fit in fits for job in jobs_of(fit, name, RESTARTS)]
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        ends = list(pool.map(reference, jobs))
    E = np.concatenate([fit.objective for fit in fits])
    best = np.array([e[0] for e in ends])
    agreed = np.concatenate([fit.search.agreeing / fit.search.starts for fit in fits])
    theirs = np.array([np.mean(e <= max(e[0] * (1.0 + FOUND), EXACT)) for e in ends])
    found = excess(E, best) <= FOUND
    print(
        f"{name}: {found.sum()} of {len(E)} optima, {np.sum(excess(best, E) > FOUND)} below all restarts;"
        f" starts that agree: median {np.median(agreed):.2f}, least {agreed.min():.2f};"
        f" restarts: {np.median(theirs):.2f}, {theirs.min():.2f}"
    )
    missed, most = MISSED.get(name, (0, FOUND))
    off = [(k, excess(E, best)[k]) for k in np.flatnonzero(~found)]
    assert len(off) <= missed, off
    assert excess(E, best).max() <= most, off

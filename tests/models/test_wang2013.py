"""The model pair, NumPy and OpenCL, against equations (8)-(12) in 60 digits."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import diff, mpf

import clbrdf
from clbrdf import Directions
from clbrdf.models import get_model
from tests.reference import exact, naive

MODEL = get_model("wang2013")
TILE = dict(zip(MODEL.names, naive.CERAMIC_TILE, strict=True))
FOIL = dict(zip(MODEL.names, naive.TIN_FOIL, strict=True))


def domain_points(count: int, seed: int):
    """Random parameters within the bounds and directions over the whole domain, ends included."""
    rng = np.random.default_rng(seed)
    zenith = np.concatenate([[0.0, 1e-6, 45.0, 85.0, 89.9, 89.999999], rng.uniform(0.0, 89.99, 94)])
    azimuth = np.concatenate([[0.0, 1e-6, 90.0, 179.999999, 180.0, 270.0], rng.uniform(0.0, 360.0, 94)])
    theta_i, theta_r = rng.choice(zenith, count), rng.choice(zenith, count)
    theta_r = np.where(rng.random(count) < 0.2, theta_i, theta_r)  # mirror and retro directions are likely
    phi = rng.choice(azimuth, count)
    columns = []
    for p in MODEL.parameters:
        low, high = p.bounds
        if p.scale == "log":
            largest = max(abs(low), abs(high))
            values = p.sign * largest * 10.0 ** rng.uniform(-9.0, 0.0, count)
        else:
            values = rng.uniform(low, high, count)
        at_end = rng.random(count)
        columns.append(np.where(at_end < 0.03, low, np.where(at_end > 0.97, high, values)))
    return np.stack(columns, axis=1), theta_i, theta_r, phi


@pytest.fixture(scope="module")
def exact_grid():
    parameters, *angles = domain_points(10_000, seed=1)
    values = [exact.brdf(p, *a) for p, a in zip(parameters, zip(*angles, strict=True), strict=True)]
    return parameters, angles, values


def worst_relative(values, references):
    errors = [float(abs(mpf(float(v)) - r) / r) for v, r in zip(values, references, strict=True) if r > 1e-30]
    assert len(errors) > 9_000
    return max(errors)


def pairwise(evaluate, parameters, angles):
    """Evaluate point k with parameter set k, in slices to keep the (N, W) squares small."""
    out = np.empty(len(parameters))
    for first in range(0, len(out), 250):
        part = slice(first, first + 250)
        named = dict(zip(MODEL.names, parameters[part].T, strict=True))
        out[part] = np.diag(evaluate(named, *(a[part] for a in angles)))
    return out


def test_kernel_double_is_exact_to_1e_12_over_the_domain(exact_grid, device):
    parameters, angles, references = exact_grid

    def evaluate(named, *part):
        return clbrdf.evaluate(named, *part, device=device)

    values = pairwise(evaluate, parameters, angles)
    assert np.isfinite(values).all()
    assert worst_relative(values, references) <= 1e-12


def test_numpy_reference_is_exact_to_1e_12_over_the_domain(exact_grid):
    parameters, angles, references = exact_grid
    values = [
        MODEL.brdf(p[None, :], MODEL.features(Directions.relative(*a)))[0]
        for p, a in zip(parameters, zip(*angles, strict=True), strict=True)
    ]
    assert worst_relative(values, references) <= 1e-12


def test_kernel_single_has_no_nan_and_six_digits_where_nothing_is_extreme(device):
    theta_i, theta_r = np.repeat([30.0, 45.0, 60.0], 86), np.tile(np.arange(86.0), 3)
    values = clbrdf.evaluate(FOIL, theta_i, theta_r, 180.0, precision="single", device=device)
    # Exponents of up to 300 log2 units, rounded to 24 bits: 300 · 2^-24 · ln 2 = 1.2e-5.
    np.testing.assert_allclose(values, naive.brdf(naive.TIN_FOIL, theta_i, theta_r, 180.0), rtol=2e-5)


@pytest.mark.parametrize(
    ("parameters", "peaks"),
    # Table 1 in the mirror direction, by hand: G = 2 tanθ there, D = 1.
    [(naive.TIN_FOIL, (350.8296, 657.6042, 1996.7208)), (naive.CERAMIC_TILE, (201.8846, 291.8941, 861.6960))],
)
def test_peaks_of_table_1(parameters, peaks, device):
    named = dict(zip(MODEL.names, parameters, strict=True))
    angles = np.array([30.0, 45.0, 60.0])
    a, b, _, _, ks, kd = parameters
    cosine = np.cos(np.deg2rad(angles))
    by_hand = 2 * ks * np.tan(np.deg2rad(angles)) * np.exp(a * (b - cosine) ** 2) / (np.pi * cosine**2)
    by_hand += kd / np.pi
    np.testing.assert_allclose(by_hand, peaks, rtol=1e-6)
    np.testing.assert_allclose(
        clbrdf.evaluate(named, angles, angles, 180.0, device=device), by_hand, rtol=1e-12
    )


@pytest.mark.parametrize(
    "parameters", [naive.TIN_FOIL, naive.CERAMIC_TILE, (-8.0, 1.2, -5.0, 1.6, 0.02, 0.3)]
)
@pytest.mark.parametrize(
    "angles", [(30.0, 28.0, 180.0), (60.0, 61.0, 175.0), (45.0, 10.0, 20.0), (5.0, 80.0, 90.0)]
)
def test_jacobian_against_exact_derivatives(parameters, angles):
    ours = MODEL.jacobian(np.array(parameters)[None, :], MODEL.features(Directions.relative(*angles)))[0]
    for j in range(6):

        def along(value, j=j):
            return exact.brdf([*parameters[:j], value, *parameters[j + 1 :]], *angles)

        reference = float(diff(along, parameters[j]))
        assert ours[j] == pytest.approx(reference, rel=1e-10, abs=1e-250)


def test_no_specular_part_in_the_retro_direction():
    for theta in (0.0, 30.0, 89.0):
        values = clbrdf.evaluate(FOIL | {"kd": 0.0}, theta, theta, 0.0)
        assert values.tolist() == [0.0]


def test_ks_zero_leaves_the_diffuse_part_alone():
    values = clbrdf.evaluate(FOIL | {"ks": 0.0}, [0.0, 60.0], [10.0, 60.0], 180.0)
    np.testing.assert_allclose(values, FOIL["kd"] / np.pi, rtol=1e-15)


def test_overflow_of_one_factor_does_not_spoil_the_product(device):
    # F = e^180 and D = e^-500 together are finite; F alone leaves fp32.
    named = {"a": 20.0, "b": 2.0, "c": -2000.0, "d": 1.0, "ks": 1.0, "kd": 1.0}
    angles = (60.0, 0.0, 180.0)
    reference = float(exact.brdf([named[n] for n in MODEL.names], *angles))
    assert clbrdf.evaluate(named, *angles, device=device)[0] == pytest.approx(reference, rel=1e-12)
    assert np.isfinite(clbrdf.evaluate(named, *angles, precision="single", device=device)).all()


def test_many_parameter_sets_at_once_equal_one_at_a_time(device):
    angles = np.linspace(0.0, 80.0, 37)
    both = {name: np.array([FOIL[name], TILE[name]]) for name in MODEL.names}
    together = clbrdf.evaluate(both, 45.0, angles, 180.0, device=device)
    assert together.shape == (37, 2)
    for k, named in enumerate((FOIL, TILE)):
        assert (together[:, k] == clbrdf.evaluate(named, 45.0, angles, 180.0, device=device)).all()


def test_blocks_of_directions_and_wavelengths_do_not_change_values(monkeypatch):
    import sys

    angles = np.linspace(0.0, 80.0, 45)
    both = {name: np.linspace(FOIL[name], TILE[name], 7) for name in MODEL.names}
    whole = clbrdf.evaluate(both, 45.0, angles, 180.0)
    monkeypatch.setattr(sys.modules["clbrdf.opencl.values"], "BLOCK_VALUES", 20)
    assert (clbrdf.evaluate(both, 45.0, angles, 180.0) == whole).all()


def test_the_model_is_not_reciprocal():
    there = clbrdf.evaluate(FOIL, 30.0, 40.0, 180.0)[0]
    back = clbrdf.evaluate(FOIL, 40.0, 30.0, 180.0)[0]
    # F depends on the incident angle alone: the ratio is that of F where the lobe dominates.
    a, b = FOIL["a"], FOIL["b"]
    ratio = np.exp(a * ((b - np.cos(np.deg2rad(30.0))) ** 2 - (b - np.cos(np.deg2rad(40.0))) ** 2))
    diffuse = FOIL["kd"] / np.pi
    assert (there - diffuse) / (back - diffuse) == pytest.approx(ratio, rel=1e-10)

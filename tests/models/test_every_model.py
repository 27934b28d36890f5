"""One suite over every model and six sums: values and derivatives against the published forms, and promises.

The references are in tests/reference/models: written from the sources in 150 digits, sharing nothing with the
package. What a page states of itself (reciprocal, bounded, its linear parameters) is asked of each.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import clbrdf
from clbrdf import Directions
from clbrdf.models import BOUNDED, NEEDS_PHI, RECIPROCAL, SIGNED, get_model, model_names
from clbrdf.opencl.precision import get_precision
from clbrdf.opencl.values import evaluate_directions
from tests.reference.models import REFERENCES
from tests.reference.models.domain import Row, domain_points

SUMS = (
    "ggx+minnaert",
    "abg+abg+lambert",
    "ggx+ggx+lambert",
    "wang2013+eon",
    "beckmann+oren_nayar",
    "ward+eon",
)
MODELS = (*model_names(), *SUMS)
SINGLE = tuple(name for name in MODELS if "+" not in name)

WAVELENGTH = 550.0

POINTS, POINTS_OF_SUMS = 10_000, 2_000
QUICK, QUICK_OF_SUMS = 1_200, 700
"""Points in `make test`: references of 150 digits take time. Hard cases, up to 578, come first."""

SLOPES = 100
"""Points at which derivatives are compared; every one costs two references a parameter."""

BOUND = 1e-11
"""Relative error of values and derivatives in double precision, wherever the value exceeds 1e-30."""


@cache
def points(name, quick=False):
    """Parameters (K, P) and angles (K, 4) of a model over its domain, hard cases first."""
    model = get_model(name)
    rows = [
        Row(
            p.symbol,
            *p.bounds,
            "log" if p.scale == "log" else "lin",
            *([p.log_floor] if p.log_floor and 0.0 in p.bounds else []),
        )
        for p in model.parameters
        if p.given != "wavelength"
    ]
    single, of_sums = (QUICK, QUICK_OF_SUMS) if quick else (POINTS, POINTS_OF_SUMS)
    found = domain_points(rows, single if name in SINGLE else of_sums, seed=1)
    parameters = np.array([[p.get(row.symbol, WAVELENGTH) for row in model.parameters] for p, _ in found])
    angles = np.array([angles for _, angles in found])
    # Records keep azimuths in [0, 360): what a negative one loses by that is no error of the model.
    angles[:, [1, 3]] = np.mod(angles[:, [1, 3]], 360.0)
    return parameters, angles


def parts_of(name):
    """Name of each part's reference, and the places of its parameters in the sum's table."""
    if "+" not in name:
        return [(name, range(len(get_model(name).parameters)))]
    names, first, out = name.split("+"), 0, []
    for part in names:
        keys = {n.split(".")[0] for n in get_model(name).names}
        own = [k for k in sorted(keys) if k.rstrip("12") == part or k == part]
        key = own[sum(p == part for p, _ in out)] if len(own) > 1 else own[0]
        places = [j for j, n in enumerate(get_model(name).names) if n.split(".")[0] == key]
        out.append((part, places))
        first += len(places)
    return out


def exact(name, parameters, angles):
    """The published value in 150 digits, as a float; of a sum, that of its parts."""
    total = 0
    for part, places in parts_of(name):
        reference = REFERENCES[part]
        given = dict(zip(reference.parameters, parameters[list(places)], strict=False))
        if part == "wang2013" and "+" in name:
            given["kd"] = 0.0  # the base of the sum stands in its place
        total = total + reference.value(
            given, *angles, wavelength=WAVELENGTH if reference.needs_wavelength else None
        )
    return float(total)


def on_device(model, parameters, angles, precision, device):
    """Value of point k with parameter set k, in slices to keep the (N, W) squares small."""
    out = np.empty(len(parameters))
    for first in range(0, len(out), 250):
        part = slice(first, first + 250)
        d = Directions(*angles[part].T)
        out[part] = np.diag(evaluate_directions(model, parameters[part], d, precision, device))
    return out


def size_of(model, parameters, angles, value):
    """What an error is relative to: the value, and for models that cancel what cancels in it."""
    if not model.flags & SIGNED:
        return np.abs(value)
    # The kernels of such a model are of order 1 and cancel among themselves, too.
    return np.maximum(np.abs(value), np.abs(parameters[:, list(model.linear)]).sum(axis=1) / np.pi)


@pytest.fixture(
    scope="module",
    params=[
        *((name, True) for name in MODELS),
        *(pytest.param((name, False), marks=pytest.mark.soak) for name in MODELS),
    ],
    ids=lambda param: param[0] if param[1] else f"{param[0]}-all",
)
def case(request):
    name, quick = request.param
    parameters, angles = points(name, quick)
    values = np.array([exact(name, p, a) for p, a in zip(parameters, angles, strict=True)])
    return name, parameters, angles, values


def test_values_over_the_domain(case, device):
    name, parameters, angles, values = case
    model = get_model(name)
    ours = on_device(model, parameters, angles, get_precision("double"), device)
    assert np.isfinite(ours).all()
    size = size_of(model, parameters, angles, values)
    shown = size > 1e-30
    assert np.max(np.abs(ours - values)[shown] / size[shown]) <= BOUND
    assert (np.abs(ours[~shown]) < 1e-29).all()
    few = shown & (np.arange(len(values)) < 2000)
    for precision in ("fast:3", "fast:4", "fast:5", "fast:6", "single"):
        arithmetic = get_precision(precision)
        quick = on_device(model, parameters[few], angles[few], arithmetic, device)
        error = np.abs(quick - values[few]) / size[few]
        assert error.max() <= arithmetic.bound, precision


def test_numpy_values_and_derivatives(case):
    name, parameters, angles, values = case
    model = get_model(name)
    pick = np.random.default_rng(2).choice(len(values), SLOPES, replace=False)
    x = model.features(Directions(*angles[pick].T))
    for k, place in enumerate(pick):
        p = parameters[place]
        f = model.brdf(p[None], x[k : k + 1])[0]
        size = size_of(model, p[None], angles[place], values[place : place + 1])[0]
        assert abs(f - values[place]) <= max(BOUND * size, 1e-290)
        slopes = model.jacobian(p[None], x[k : k + 1])[0]
        for part, places in parts_of(name):
            reference = REFERENCES[part]
            given = dict(zip(reference.parameters, p[list(places)], strict=False))
            if part == "wang2013" and "+" in name:
                given["kd"] = 0.0
            wavelength = WAVELENGTH if reference.needs_wavelength else None
            expected = reference.gradient(given, tuple(angles[place]), wavelength)
            for j, own in zip(places, reference.parameters, strict=False):
                slope = float(expected[own])
                # Where a slope crosses 0, what the parameter's range would change by decides.
                low, high = model.parameters[j].bounds
                span = max(abs(p[j]), 1e-3 * (high - low))
                # A slope that is a kernel is of order 1 and cancels, whatever the parameters are.
                kernel = 1.0 / np.pi if model.flags & SIGNED else 0.0
                largest = max(abs(slope), size / span, kernel)
                assert abs(slopes[j] - slope) <= max(BOUND * largest, 1e-290), own


@pytest.mark.parametrize("name", MODELS)
def test_reciprocity(name):
    model = get_model(name)
    parameters, angles = points(name)
    parameters, angles = parameters[-500:], angles[-500:]
    back = angles[:, [2, 3, 0, 1]]
    there, returned = (
        np.array(
            [
                model.brdf(p[None], x[None])[0]
                for p, x in zip(parameters, model.features(Directions(*a.T)), strict=True)
            ]
        )
        for a in (angles, back)
    )
    size = np.maximum(size_of(model, parameters, angles, there), 1e-30)
    worst = np.max(np.abs(there - returned) / size)
    if model.flags & RECIPROCAL:
        assert worst <= BOUND
    else:
        assert worst > 1e-3


@pytest.mark.parametrize("name", SINGLE)
def test_energy_where_it_is_promised(name):
    """The directional-hemispherical reflectance, by quadrature of its own: θr in Gauss points, φ evenly."""
    model = get_model(name)
    if not model.flags & BOUNDED:
        pytest.skip("promises no bound")
    nodes, weights = np.polynomial.legendre.leggauss(160)
    theta_r = 45.0 * (nodes + 1.0)
    phi_r = (np.arange(180) + 0.5) * 2.0
    weight = np.repeat(weights * np.pi / 4.0 * np.sin(np.radians(theta_r)) * np.cos(np.radians(theta_r)), 180)
    weight *= np.radians(2.0)
    view, azimuth = (grid.ravel() for grid in np.meshgrid(theta_r, phi_r, indexing="ij"))
    largest = [
        p.bounds[1] if p.name not in ("alpha", "alpha_x", "alpha_y", "k", "n") else p.default
        for p in model.parameters
    ]
    reflectance = dict(zip(model.names, largest, strict=True)).get("rho", 1.0)
    for alpha in (0.1, 0.5):
        parameters = np.array(
            [alpha if name.startswith("alpha") else v for name, v in zip(model.names, largest, strict=True)]
        )
        for theta_i in (0.0, 30.0, 60.0, 80.0):
            d = Directions(np.full(view.shape, theta_i), 0.0, view, azimuth)
            values = model.brdf(parameters[None], model.features(d))
            # The quadrature itself is good to 1e-4 for lobes of this width.
            assert values @ weight <= max(1.0, reflectance) + 1e-3


@pytest.mark.parametrize("name", MODELS)
def test_what_a_table_calls_linear_is(name):
    model = get_model(name)
    parameters, angles = points(name)
    x = model.features(Directions(*angles[-50:].T))
    p = parameters[-1]
    for j in model.linear:
        doubled, without = p.copy(), p.copy()
        doubled[j], without[j] = 2.0 * p[j], 0.0
        one, two, none = (model.brdf(v[None], x) for v in (p, doubled, without))
        np.testing.assert_allclose(two - one, one - none, rtol=1e-9, atol=1e-12 * np.abs(one).max())


@pytest.mark.parametrize("name", MODELS)
def test_one_lane_and_many_agree(name, device, monkeypatch):
    from clbrdf.opencl import lanes, program

    parameters, angles = points(name)
    d = Directions(*angles[-64:].T)
    model, double = get_model(name), get_precision("double")
    many = evaluate_directions(model, parameters[-3:], d, double, device)
    monkeypatch.setattr(program, "lanes_of", lambda *_: lanes.Lanes(1, 1))
    one = evaluate_directions(model, parameters[-3:], d, double, device)
    # Both are good to the stated bound; one lane takes the compiler's own scalar functions in places.
    np.testing.assert_allclose(one, many, rtol=BOUND, atol=1e-14)


@pytest.mark.parametrize("name", MODELS)
def test_azimuth_matters_only_where_it_is_said(name):
    model = get_model(name)
    parameters, angles = points(name)
    turned = angles[-200:].copy()
    turned[:, [1, 3]] = np.mod(turned[:, [1, 3]] + 32.0, 360.0)
    values = [
        np.diag(model.brdf(parameters[-200:][:, None, :], model.features(Directions(*a.T))))
        for a in (angles[-200:], turned)
    ]
    same = np.allclose(values[0], values[1], rtol=1e-6, atol=1e-9)
    assert same != bool(model.flags & NEEDS_PHI)


def test_limits_between_models():
    angles = (
        np.array([10.0, 40.0, 70.0, 5.0]),
        np.array([30.0, 45.0, 60.0, 80.0]),
        np.array([180.0, 60.0, 0.0, 170.0]),
    )

    def f(model, **parameters):
        return clbrdf.evaluate(parameters, *angles, model=model)

    np.testing.assert_allclose(f("eon", rho=0.4, r=0.0), 0.4 / np.pi, rtol=1e-14)
    np.testing.assert_allclose(f("minnaert", rho=0.4, k=1.0), 0.4 / np.pi, rtol=1e-14)
    np.testing.assert_allclose(
        f("abg", b0=3.0, x_k=0.05, g=2.0), f("kcorr", b0=3.0, l=0.05, C=2.0), rtol=1e-12
    )
    same = {"alpha_x": 0.2, "alpha_y": 0.2, "F0": 0.3, "F90": 0.9}
    np.testing.assert_allclose(f("ggx_anisotropic", **same), f("ggx", alpha=0.2, F0=0.3, F90=0.9), rtol=1e-12)
    np.testing.assert_allclose(
        f("ward_anisotropic", rho_s=0.3, alpha_x=0.2, alpha_y=0.2),
        f("ward", rho_s=0.3, alpha=0.2),
        rtol=1e-12,
    )
    # A dielectric is a conductor without absorption.
    np.testing.assert_allclose(
        f("ggx_dielectric", alpha=0.2, n=1.5, scale=1.0),
        f("ggx_conductor", alpha=0.2, n=1.5, k=0.0, scale=1.0),
        rtol=1e-12,
    )

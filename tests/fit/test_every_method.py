"""Every method, the check, smooth parameters, tolerances, scenes, report and optimizers, for any model.

A few models that differ in kind stand for all: none linear, all linear, linear of any sign, linear on a log
scale, constants that have to be told, equal parts, both azimuths. The long part takes all of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Fit, Scan
from clbrdf.fit.problem import make_problem
from clbrdf.models import NEEDS_PHI, get_model
from clbrdf.objective import weight_matrix
from clbrdf.opencl.precision import get_precision
from clbrdf.optimizers import OPTIMIZERS, minimise
from clbrdf.optimizers.check import check_fit
from clbrdf.optimizers.device_objective import DeviceObjective
from clbrdf.optimizers.objective import NumpyObjective
from clbrdf.optimizers.separable import SeparableObjective
from clbrdf.scene import simulate
from tests.fit.test_every_optimum import NOISE, directions, told, truth
from tests.models.test_every_model import MODELS
from tests.planted import with_parameters
from tests.scene.scenes import scene

KINDS = ("lambert", "eon", "ross_li", "rayleigh_rice", "ggx_anisotropic", "ggx+ggx+lambert")

FEW = [pytest.param(name, marks=[] if name in KINDS else pytest.mark.soak) for name in MODELS]

CHAINS = ("anneal", "anneal-separable", "tempering")

REACHED = 1e-6
"""Relative excess of E over the usual method's."""


def small(name, wavelengths=2):
    """A noisy scan of the model, 144 directions, neighbours much alike."""
    model = get_model(name)
    d = directions(bool(model.flags & NEEDS_PHI))
    rng = np.random.default_rng(11)
    parameters = truth(name, rng)
    nm = 540.0 + 10.0 * np.arange(wavelengths)
    sets = np.repeat(parameters[None], wavelengths, axis=0)
    for j, row in enumerate(model.parameters):
        if row.given == "wavelength":
            sets[:, j] = nm
        elif row.linear:
            sets[:, j] *= np.linspace(1.0, 0.9, wavelengths)
    f = np.abs(model.brdf(sets[:, None, :], model.features(d)).T)
    f *= 1.0 + NOISE * rng.standard_normal(f.shape)
    return Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, nm, f)


def fitted(scan, name, **options):
    return clbrdf.fit(scan, model=name, weights="relative", fix=told(get_model(name)), **options)


@pytest.mark.parametrize("method", CHAINS)
@pytest.mark.parametrize("name", FEW)
def test_chains_end_where_the_usual_method_does(name, method):
    scan, model = small(name), get_model(name)
    if method == "anneal-separable" and not model.linear:
        with pytest.raises(clbrdf.InputError, match="needs linear parameters that are free"):
            fitted(scan, name, method=method)
        return
    usual, other = fitted(scan, name), fitted(scan, name, method=method)
    assert (other.objective <= usual.objective * (1.0 + REACHED)).all()
    assert (usual.objective <= other.objective * (1.0 + REACHED)).all()
    assert other.setup.method == method


@pytest.mark.parametrize("name", FEW)
def test_the_check_agrees_and_finds_a_planted_fault(name):
    fit = fitted(small(name), name)
    assert {v.word for v in check_fit(fit, effort=0.1)} <= {"agreed", "better"}
    free = next(n for n in fit.model.names if n not in fit.given and np.isfinite(fit.sigma[n]).all())
    parameters = {key: values.copy() for key, values in fit.parameters.items()}
    parameters[free] += 0.2 * fit.sigma[free]  # E rises by 0.04/(N − P) or more
    planted = check_fit(with_parameters(fit, parameters), [0], effort=0.1)
    assert [v.word for v in planted] == ["worse"]


@pytest.mark.parametrize("name", FEW)
def test_smooth_parameters(name):
    scan = small(name, 4)
    alone, tied = fitted(scan, name), fitted(scan, name, smooth=0.02)
    assert (tied.objective >= alone.objective * (1.0 - 1e-9)).all()
    assert (tied.objective <= alone.objective * 1.5).all()
    assert "not converged" not in tied.status.tolist()

    def roughness(fit):
        """What the penalty adds up: squares of changes, as shares of the ranges."""
        limits = fit.model.coordinate_bounds(fit.setup.bounds)
        free = np.array([name not in fit.given for name in fit.model.names])
        q = fit.model.to_coordinates(fit.vector)
        return ((np.diff(q, axis=0) / np.ptp(limits, axis=1))[:, free] ** 2).sum()

    assert roughness(tied) <= roughness(alone) * (1.0 + 1e-6)


@pytest.mark.parametrize("name", FEW)
def test_a_tolerance_is_kept(name):
    scan = small(name, 3)
    usual, quick = fitted(scan, name), fitted(scan, name, rtol=1e-3)
    assert (quick.objective <= usual.objective * (1.0 + 1e-3)).all()
    assert quick.search.rungs


@pytest.mark.parametrize("name", FEW)
def test_file_scene_and_report(name, tmp_path):
    from clbrdf.viz.report import write_report

    fit = fitted(small(name), name)
    fit.save(tmp_path / "fit.h5")
    again = Fit.open(tmp_path / "fit.h5")
    assert again.model.name == name
    assert again.given == fit.given
    np.testing.assert_array_equal(again.vector, fit.vector)
    # A scene that is lit by the fit, in directions of its own.
    surface = {"file": str(tmp_path / "fit.h5")}
    made = simulate(scene(surface=surface, wavelength=(540.0, 550.0)))
    expected = fit.evaluate(made.directions)
    np.testing.assert_allclose(made.brdf, expected, rtol=1e-9, atol=1e-14)
    # And one that is lit by the model.
    named = dict(zip(fit.model.names, fit.vector[0].tolist(), strict=True))
    named = {key: value for key, value in named.items() if fit.model.parameter(key).given != "wavelength"}
    made = simulate(scene(surface={"model": name, "parameters": named}, wavelength=(540.0,)))
    np.testing.assert_allclose(made.brdf[:, 0], expected[:, 0], rtol=1e-9, atol=1e-14)
    files, _ = write_report(fit, tmp_path / "report")
    text = files[0].read_text(encoding="utf-8")
    assert all(parameter in text for parameter in fit.model.names)


@pytest.mark.parametrize("name", FEW)
def test_optimizers_reach_the_optimum_and_none_breaks(name, device):
    scan, model = small(name, 1), get_model(name)
    fit = fitted(scan, name)
    given = {key: fit.parameters[key] for key in fit.given}
    problem = make_problem(scan, weight_matrix(scan, "relative"), model, model.bounds(), device, given)
    objective, twin = NumpyObjective(problem), DeviceObjective(problem)
    q = np.random.default_rng(5).uniform(0.4, 0.6, (3, len(objective.lower)))
    q = objective.lower + q * (objective.upper - objective.lower)
    # fp64 on both sides: what cancels in E is lost on both.
    np.testing.assert_allclose(twin.values(q), objective.values(q), rtol=1e-9)
    E, slopes = objective.value_and_gradient(q[0])
    twin_E, twin_slopes = twin.value_and_gradient(q[0])
    assert twin_E == pytest.approx(E, rel=1e-9)
    np.testing.assert_allclose(twin_slopes, slopes, rtol=1e-7, atol=1e-9 * np.abs(slopes).max())
    for optimizer in OPTIMIZERS:
        trace = minimise(optimizer, objective, evaluations=200, seed=1, seconds=5.0)
        assert trace.best >= fit.objective[0] * (1.0 - 1e-9), optimizer
    best = minimise("least-squares", objective, evaluations=4000, seed=1)
    assert best.best <= fit.objective[0] * (1.0 + REACHED)
    if 0 < len(objective.linear) < len(objective.lower):
        inside = SeparableObjective(objective)
        trace = minimise("evolution", inside, evaluations=4000, seed=1)
        assert trace.best <= fit.objective[0] * (1.0 + 1e-3)


def test_incident_azimuths_of_an_anisotropic_scan_count(device):
    name = "ggx_anisotropic"
    scan = small(name)
    fit = fitted(scan, name)
    assert (fit.objective < 4.0 * NOISE**2).all()
    ignored = replace(scan, phi_i=np.zeros_like(scan.phi_i), phi_r=scan.phi)
    assert (fitted(ignored, name).objective > 2.0 * fit.objective).all()
    values = clbrdf.evaluate(
        {key: float(v[0]) for key, v in fit.parameters.items()},
        *(scan.theta_i, scan.theta_r, scan.phi),
        phi_i=scan.phi_i,
        model=name,
        device=device,
        precision=get_precision("double").name,
    )
    np.testing.assert_allclose(values, fit.evaluate()[:, 0], rtol=1e-9)

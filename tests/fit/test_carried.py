"""Components carried to the parameters, against dense covariances of all values at once."""

import numpy as np
import pytest

import clbrdf
from clbrdf.errors import InputError
from clbrdf.fit.carried import fewer
from clbrdf.models import get_model
from clbrdf.scan import Component, Correlation, Scan
from tests.test_components import covariance, make_components

RANDOM, SYSTEMATIC = Correlation("random"), Correlation("systematic")
MODEL = get_model("ward+lambert")
TRUTH = {"ward.rho_s": 0.3, "ward.alpha": 0.25, "lambert.rho": 0.4}


def made(components, w=3, seed=0, noise=0.0, truth=None):
    rng = np.random.default_rng(seed)
    theta_r = np.tile(np.arange(0.0, 76.0, 15.0), 2)
    theta_i = np.repeat([20.0, 45.0], 6)
    zero = np.zeros(12)
    scan = Scan(theta_i, zero, theta_r, zero + 180.0, 500.0 + 30.0 * np.arange(w), np.ones((12, w)))
    vector = MODEL.vector(TRUTH if truth is None else truth)
    values = MODEL.brdf(vector[None, :], MODEL.features(scan.directions))[:, None] * np.linspace(1.0, 0.8, w)
    values = values * (1.0 + noise * rng.standard_normal((12, w)))
    return Scan(theta_i, zero, theta_r, zero + 180.0, scan.wavelength, values, components=components)


def dense(fit, places):
    """Covariance of all parameters at all wavelengths, one after the other, from (W N) × (W N) matrices."""
    scan, (n, w), p = fit.scan, fit.scan.brdf.shape, len(fit.model.names)
    x, vector = fit.model.features(scan.directions), fit.vector
    free = np.array([name not in fit.given for name in fit.model.names])
    J = np.zeros((n, w, w, p))
    for k in range(w):
        for j in np.flatnonzero(free):
            step = 1e-5 * max(abs(vector[k, j]), 1e-3)
            ends = [vector[k] + s * step * np.eye(p)[j] for s in (1.0, -1.0)]
            J[:, k, k, j] = (fit.model.brdf(ends[0], x) - fit.model.brdf(ends[1], x)) / (2.0 * step)
    J = J.reshape(n * w, w * p)
    # Shared parameters are one column for all wavelengths.
    columns = np.zeros((w * p, 0))
    for j in np.flatnonzero(free):
        one = np.zeros((w, p, 1 if fit.model.names[j] in fit.shared else w))
        one[np.arange(w), j, 0 if one.shape[2] == 1 else np.arange(w)] = 1.0
        columns = np.concatenate([columns, one.reshape(w * p, -1)], axis=1)
    g = fit.setup.weights.ravel()
    J = J @ columns
    answer = columns @ np.linalg.solve(J.T @ (g[:, None] * J), J.T * g)
    model = Scan(
        *(getattr(scan, name) for name in ("theta_i", "phi_i", "theta_r", "phi_r", "wavelength")),
        fit.evaluate(),
        components=scan.components,
    )
    return [answer @ covariance(model, one) @ answer.T for one in model.components if places(one)]


def joint(part):
    """The same from a part of the fit."""
    m, w, p = part.modes.shape
    out = part.modes.reshape(m, w * p).T @ part.modes.reshape(m, w * p)
    for k in range(w):
        out[k * p : k * p + p, k * p : k * p + p] += part.own[k]
    return out


@pytest.mark.parametrize("shared", [(), ("ward.alpha",)])
@pytest.mark.parametrize("seed", range(6))
def test_every_component_is_carried_as_a_dense_covariance_is(seed, shared):
    noise = Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM)
    # Over many forms and sizes: the seeds 0 to 5 take each form at least twice.
    scan = made((noise, *make_components(12, 3, seed)), seed=seed, noise=0.003)
    fit = clbrdf.fit(scan, model=MODEL, weights="sigma", shared=shared)
    assert fit.status.tolist() == ["converged"] * 3
    assert [part.name for part in fit.estimate.parts] == [one.name for one in scan.components]
    whole = np.zeros((9, 9))
    for part, expected in zip(fit.estimate.parts, dense(fit, lambda one: True), strict=True):
        # Differences of the reference are good to about 1e-7, and so is its answer to what does not act.
        size = np.sqrt(np.maximum(np.diag(expected), 0.0)) + 1e-4 * np.abs(fit.vector.ravel())
        scale = np.outer(size, size)
        found = joint(part)
        np.testing.assert_allclose(found / scale, expected / scale, atol=1e-5)
        whole += found
    sigma = np.stack([fit.sigma[name] for name in MODEL.names], axis=-1)
    np.testing.assert_allclose(sigma.ravel(), np.sqrt(np.diag(whole)), rtol=1e-4)


def test_a_common_scale_goes_whole_into_what_is_linear_and_not_into_the_width():
    scale = Component("panel", 0.03)
    noise = Component("noise", 1e-4, True, RANDOM, SYSTEMATIC, RANDOM)
    fit = clbrdf.fit(made((noise, scale)), model=MODEL, weights="sigma")
    panel = fit.estimate.parts[1]
    share = np.sqrt(np.diagonal(panel.covariance, axis1=1, axis2=2)) / np.abs(fit.vector)
    for name, expected in (("ward.rho_s", 0.03), ("lambert.rho", 0.03), ("ward.alpha", 0.0)):
        np.testing.assert_allclose(share[:, MODEL.names.index(name)], expected, atol=1e-9)


def test_without_a_random_part_the_residuals_tell_it():
    scale = Component("panel", 0.03)
    bare = clbrdf.fit(made((), noise=0.01), model=MODEL, weights="relative")
    fit = clbrdf.fit(made((scale,), noise=0.01), model=MODEL, weights="relative")
    assert [part.name for part in fit.estimate.parts] == ["scatter of the residuals", "panel"]
    expected = np.hypot(bare.sigma["lambert.rho"], 0.03 * fit.parameters["lambert.rho"])
    np.testing.assert_allclose(fit.sigma["lambert.rho"], expected, rtol=1e-9)


def test_a_parameter_at_its_bound_has_no_part():
    scan = made((Component("panel", 0.03),), noise=0.01)
    fit = clbrdf.fit(scan, model=MODEL, weights="relative", bounds={"ward.alpha": (0.4, 0.5)})
    assert fit.status.tolist() == ["at bound"] * 3
    assert np.isnan(fit.sigma["ward.alpha"]).all()
    j = MODEL.names.index("ward.alpha")
    assert all((part.covariance[:, j] == 0.0).all() for part in fit.estimate.parts)


def test_neighbours_that_are_tied_answer_a_common_error_together():
    scan = made((Component("panel", 0.03),), noise=0.002, w=4)
    fit = clbrdf.fit(scan, model=MODEL, weights="relative", smooth=0.05)
    panel = fit.estimate.parts[1]
    # A common factor moves both amplitudes as it moves the data; a penalty holds back little of it.
    share = np.sqrt(np.diagonal(panel.covariance, axis1=1, axis2=2)) / np.abs(fit.vector)
    assert share[:, MODEL.names.index("lambert.rho")] == pytest.approx(0.03, rel=0.05)
    assert (share[:, MODEL.names.index("ward.alpha")] < 1e-3).all()


def test_fewer_modes_say_the_same():
    rng = np.random.default_rng(1)
    modes = np.einsum("mk,kwp->mwp", rng.normal(size=(200, 5)), rng.normal(size=(5, 3, 4)))
    few = fewer(modes)
    assert len(few) == 5
    np.testing.assert_allclose(np.einsum("mwp,mvq->wpvq", few, few), np.einsum("mwp,mvq->wpvq", modes, modes))


def test_the_file_keeps_the_parts(tmp_path):
    noise = Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM)
    fit = clbrdf.fit(made((noise, Component("panel", 0.03))), model=MODEL, weights="sigma")
    fit.save(tmp_path / "fit.h5")
    again = clbrdf.Fit.open(tmp_path / "fit.h5")
    for part, other in zip(fit.estimate.parts, again.estimate.parts, strict=True):
        assert (part.name, part.words, part.is_common) == (other.name, other.words, other.is_common)
        assert part.own.tobytes() == other.own.tobytes()
        assert part.modes.tobytes() == other.modes.tobytes()


def test_the_mean_over_wavelengths_keeps_what_is_common():
    noise = Component("noise", 0.02, True, RANDOM, SYSTEMATIC, RANDOM)
    fit = clbrdf.fit(made((noise, Component("panel", 0.03)), w=4), model=MODEL, weights="sigma")
    mean = fit.mean("lambert.rho")
    kd = fit.parameters["lambert.rho"]
    assert mean.value == pytest.approx(kd.mean())
    assert mean.count == 4
    random = fit.budget("lambert.rho")["noise"]
    assert mean.parts["panel"] == pytest.approx(0.03 * kd.mean(), rel=1e-9)
    assert mean.parts["noise"] == pytest.approx(np.sqrt((random**2).sum()) / 4.0, rel=1e-9)
    assert mean.sigma == pytest.approx(np.hypot(mean.parts["panel"], mean.parts["noise"]))


def test_generalised_least_squares_against_the_dense_solution():
    noise = Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM)
    alignment = Component("alignment", np.linspace(-0.02, 0.03, 12)[:, None], False, SYSTEMATIC, RANDOM)
    scan = made((noise, Component("panel", 0.03), alignment), noise=0.01, seed=5, w=2)
    usual = clbrdf.fit(scan, model=MODEL, weights="sigma")
    fit = clbrdf.fit(scan, model=MODEL, weights="sigma", gls=True)
    x = MODEL.features(scan.directions)
    from scipy.optimize import least_squares

    for k in range(2):
        weighing = Scan(
            *(getattr(scan, name) for name in ("theta_i", "phi_i", "theta_r", "phi_r")),
            scan.wavelength[k : k + 1],
            usual.evaluate()[:, k : k + 1],
            components=tuple(one.columns([k]) for one in scan.components),
        )
        V = sum(covariance(weighing, one) for one in weighing.components)
        L = np.linalg.cholesky(V)

        def whitened(p, L=L, k=k):
            return np.linalg.solve(L, MODEL.brdf(p, x) - scan.brdf[:, k])

        end = least_squares(whitened, fit.vector[k], x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        np.testing.assert_allclose(fit.vector[k], end.x, rtol=1e-6)
        expected = np.linalg.inv(end.jac.T @ end.jac)
        found = sum(part.covariance for part in fit.estimate.parts)[k]
        # The covariance is of the model's values at this optimum, the weights of those at the usual one.
        np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(expected)), rtol=0.05)
    assert not np.allclose(fit.vector, usual.vector, rtol=1e-4)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"smooth": 0.01}, "gls fits every wavelength by itself"),
        ({"shared": ("ward.alpha",)}, "gls fits every wavelength by itself"),
        ({"weights": "relative"}, "gls weighs by the uncertainties; give weights='sigma', too"),
    ],
)
def test_generalised_least_squares_alone(more, words):
    noise = Component("noise", 0.01, True, RANDOM, SYSTEMATIC, RANDOM)
    scan = made((noise, Component("panel", 0.03)))
    with pytest.raises(InputError, match=words):
        clbrdf.fit(scan, model=MODEL, gls=True, **{"weights": "sigma", **more})

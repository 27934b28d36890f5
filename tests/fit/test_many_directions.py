"""Many directions: a sample decides where to look, all of them decide what is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clbrdf
from clbrdf import Scan
from clbrdf.fit import DictionarySettings, LookupSettings
from clbrdf.fit.finish import MOST_ENDS, lowest_ends, together
from clbrdf.fit.problem import make_problem
from clbrdf.fit.reduced import product
from clbrdf.fit.sample import MANY, SAMPLE, sample_of
from clbrdf.fit.thin import on_sample, thin_sample
from clbrdf.geometry import Directions
from clbrdf.models import get_model
from clbrdf.objective import weight_matrix
from tests.reference import naive

N = MANY + 5000


def many(parameters, columns, noise=0.02, seed=1):
    """A scan of many random directions, every wavelength with noise of its own."""
    rng = np.random.default_rng(seed)
    theta_i, theta_r = rng.choice([10.0, 30.0, 50.0], N), rng.uniform(0.0, 80.0, N)
    phi = rng.uniform(0.0, 360.0, N)
    exact = naive.brdf(parameters, theta_i, theta_r, phi)[:, None]
    values = exact * (1.0 + noise * rng.standard_normal((N, columns)))
    return Scan(theta_i, 0.0, theta_r, phi, 500.0 + 10.0 * np.arange(columns), np.abs(values))


@pytest.fixture(scope="module")
def foil():
    return many(naive.TIN_FOIL, 3)


@pytest.mark.parametrize(
    ("model", "settings"), [("wang2013", DictionarySettings), ("ggx+lambert", LookupSettings)]
)
@pytest.mark.parametrize("weights", ["none", "relative"])
def test_the_optimum_is_that_of_a_search_on_all_directions(foil, model, settings, weights):
    sampled = clbrdf.fit(foil, model=model, weights=weights)
    whole = clbrdf.fit(foil, model=model, weights=weights, settings=settings(everywhere=True))
    # Both polish to the last digit on all directions: only another optimum is farther away.
    np.testing.assert_allclose(sampled.objective, whole.objective, rtol=1e-9)
    assert "not converged" not in sampled.status.tolist()


def test_blocks_and_neighbours_do_not_change_a_wavelength(foil, monkeypatch):
    import sys

    whole = clbrdf.fit(foil)
    monkeypatch.setattr(sys.modules["clbrdf.fit.blocks"], "BLOCK_BYTES", 1)
    monkeypatch.setattr(sys.modules["clbrdf.fit.summary"], "BLOCK_BYTES", 1)
    blocks, alone = clbrdf.fit(foil), clbrdf.fit(foil.columns([1]))
    for name in ("vector", "objective", "relative_rms"):
        assert (getattr(whole, name) == getattr(blocks, name)).all(), name
        assert (getattr(whole, name)[1] == getattr(alone, name)[0]).all(), name


def test_a_wavelength_that_is_measured_in_few_directions_is_searched_in_those(foil):
    """All but 40 values are masked: hardly any of them is in the sample."""
    places = np.random.default_rng(3).choice(N, 40, replace=False)
    values = foil.brdf.copy()
    values[:, 1] = np.nan
    values[places, 1] = foil.brdf[places, 1]
    fit = clbrdf.fit(replace(foil, brdf=values, flags=None))
    few = clbrdf.fit(foil.rows(np.sort(places)).columns([1]))
    assert fit.objective[1] == pytest.approx(few.objective[0], rel=1e-9)
    np.testing.assert_allclose(fit.objective[[0, 2]], clbrdf.fit(foil).objective[[0, 2]], rtol=1e-12)


def test_descents_on_some_directions_end_where_those_on_all_do(foil, monkeypatch):
    """Of 800 directions the first way takes 256; at one wavelength all but 60 of the 800 are masked."""
    import sys

    taken = []
    polish = sys.modules["clbrdf.fit.polish"]
    monkeypatch.setattr(
        polish, "thin_sample", lambda problem, most: taken.append(most) or thin_sample(problem, most)
    )
    scan, rng = foil[:800], np.random.default_rng(4)
    mask = np.zeros(scan.brdf.shape, dtype=bool)
    mask[rng.permutation(800)[60:], 1] = True
    scan = replace(scan, flags=np.where(mask, np.uint8(1), np.uint8(0)))
    for model, settings in (("wang2013", DictionarySettings), ("ggx+lambert", LookupSettings)):
        some = clbrdf.fit(scan, model=model)
        assert set(taken) == {polish.ROUGH_DIRECTIONS}
        taken.clear()
        whole = clbrdf.fit(scan, model=model, settings=settings(everywhere=True))
        assert not taken
        # Both end on all directions in double precision: only another optimum is farther away.
        np.testing.assert_allclose(some.objective, whole.objective, rtol=1e-9)


def test_a_sample_stands_for_all_and_holds_the_nearest():
    mirror = np.random.default_rng(2).uniform(0.0, 1.0, 100_000) ** 2
    sample = sample_of(mirror, SAMPLE)
    assert len(sample.places) <= SAMPLE
    assert (np.diff(sample.places) > 0).all()
    assert sample.weight.sum() == len(mirror)
    # Of the hundred nearest, each stratum of the first ones holds one direction or two.
    nearest = np.argsort(mirror)[:100]
    assert np.isin(nearest, sample.places).sum() > 60
    # Sums keep their meaning: some 1000 values of weight up to 200 give a mean to a few per cent.
    assert np.sum(sample.weight * mirror[sample.places]) == pytest.approx(mirror.sum(), rel=0.1)


def test_sums_on_a_sample_are_weighted(foil, device):
    model = get_model("lambert")
    problem = make_problem(foil, weight_matrix(foil), model, model.bounds(), device)
    assert problem.sample is not None
    few = on_sample(problem, problem.sample)
    kept, weight = problem.sample.places, problem.sample.weight
    np.testing.assert_allclose(few.scale**2, problem.scale[:, kept] ** 2 * weight, rtol=1e-14)
    np.testing.assert_allclose(few.target / few.scale, (problem.target / problem.scale)[:, kept], rtol=1e-14)


def test_lowest_ends_are_told_apart_by_their_objective():
    energy = np.array([[2.0, 1.0, 1.0 + 1e-9, 3.0, np.inf, 2.0 * (1.0 + 1e-9)]])
    q = np.arange(6.0)[None, :, None]
    ends = lowest_ends(q, energy)
    assert ends.objective[0, :3].tolist() == [1.0, 2.0, 3.0]
    assert np.isinf(ends.objective[0, 3:]).all()
    assert ends.starts[0].tolist() == [2, 2, 1] + [0] * (MOST_ENDS - 3)
    assert ends.coordinates[0, :3, 0].tolist() == [1.0, 0.0, 3.0]
    both = together([ends, lowest_ends(q - 10.0, 0.5 * energy)])
    assert both.objective[0].tolist() == [0.5, 1.0, 1.5, 2.0]
    assert both.starts[0].tolist() == [2, 4, 1, 2]


def test_rows_of_a_product_do_not_depend_on_their_neighbours():
    rng = np.random.default_rng(4)
    left, right = rng.standard_normal((50, 258)), rng.standard_normal((258, 130))
    whole = product(left, right)
    np.testing.assert_allclose(whole, left @ right, rtol=1e-12, atol=1e-12)
    for first, last in ((0, 1), (3, 17), (49, 50)):
        assert (product(left[first:last], right) == whole[first:last]).all()


def test_incident_directions_may_all_differ(device):
    """As in files of MERL: groups of one direction each."""
    rng = np.random.default_rng(5)
    d = Directions.relative(rng.uniform(0.0, 75.0, N), rng.uniform(0.0, 80.0, N), rng.uniform(0.0, 360.0, N))
    model = get_model("ggx+lambert")
    truth = model.vector({"ggx.alpha": 0.2, "lambert.rho": 0.3})
    f = model.brdf(truth[None], model.features(d))[:, None]
    noisy = f * (1.0 + 0.02 * rng.standard_normal(f.shape))
    fit = clbrdf.fit(
        Scan(d.theta_i, d.phi_i, d.theta_r, d.phi_r, [550.0], noisy), model=model, weights="relative"
    )
    deviation = np.abs(fit.vector[0] - truth) / [fit.sigma[name][0] for name in model.names]
    assert not (deviation >= 5.0).any()  # NaN where one stands at its bound

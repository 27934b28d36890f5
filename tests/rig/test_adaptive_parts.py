"""The parts of the adaptive planner against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_helpers import write_rig

from clbrdf.bench.planner import SURFACES, SimulatedLight, bench_plan
from clbrdf.geometry import Directions
from clbrdf.rig.adaptive.candidates import make_candidates
from clbrdf.rig.adaptive.choose import Picks
from clbrdf.rig.adaptive.planner import AdaptivePlanner
from clbrdf.rig.adaptive.score import covariance, reached, scores, with_one_more
from clbrdf.rig.adaptive.spread import apart, mirror_angles, uniform_start
from clbrdf.rig.rigfile import load_rig


def problem(seed, wavelengths=2, points=9, parameters=3):
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(wavelengths, points, parameters)) * [1.0, 30.0, 0.01]
    return jacobian, random.uniform(0.5, 2.0, size=(wavelengths, points))


@given(st.integers(0, 10_000))
def test_one_more_is_the_inverse_of_the_sum(seed):
    """Sherman and Morrison against the inverse of all information together."""
    jacobian, sigma = problem(seed)
    updated = with_one_more(covariance(jacobian[:, :-1], sigma[:, :-1]), jacobian[:, -1], sigma[:, -1])
    for w in range(2):
        weighted = jacobian[w] / sigma[w][:, None]
        direct = np.linalg.inv(weighted.T @ weighted)
        # Condition numbers up to 1e9, because of units, leave seven digits.
        size = np.sqrt(np.outer(np.diag(direct), np.diag(direct)))
        np.testing.assert_allclose(updated[w] / size, direct / size, atol=1e-7)


@given(st.integers(0, 10_000))
def test_scores_are_the_drops_that_they_promise(seed):
    jacobian, sigma = problem(seed)
    cov = covariance(jacobian[:, :-1], sigma[:, :-1])
    metric = np.einsum("wp,pq->wpq", np.ones((2, 3)), np.diag([1.0, 5.0, 1e-3]))
    after = with_one_more(cov, jacobian[:, -1], sigma[:, -1])
    drop = sum(1.0 - np.trace(after[w] @ metric[w]) / np.trace(cov[w] @ metric[w]) for w in range(2))
    last = (jacobian[:, -1:], sigma[:, -1:])
    np.testing.assert_allclose(scores(*last, cov, metric)[0], drop, rtol=1e-6, atol=1e-12)
    log = sum(np.linalg.slogdet(cov[w])[1] - np.linalg.slogdet(after[w])[1] for w in range(2))
    np.testing.assert_allclose(scores(*last, cov, None)[0], log, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(
        reached(after, metric) ** 2, [np.trace(a @ m) for a, m in zip(after, metric, strict=True)]
    )


def test_what_is_open_stays_wide():
    """Two parameters that only occur as a sum: each is unknown, and nothing is infinite or NaN."""
    jacobian = np.ones((1, 5, 2))
    cov = covariance(jacobian, np.full((1, 5), 0.01))
    assert np.isfinite(cov).all()
    assert cov[0, 0, 0] > 1.0


def test_angles():
    directions = Directions.relative([30.0, 30.0, 30.0], [30.0, 40.0, 30.0], [180.0, 180.0, 0.0])
    np.testing.assert_allclose(mirror_angles(directions), [0.0, 10.0, 60.0], atol=1e-9)
    np.testing.assert_allclose(apart(directions, 0), [0.0, 10.0, 60.0], atol=1e-9)


@pytest.fixture(scope="module")
def setting(tmp_path_factory):
    rig = load_rig(write_rig(tmp_path_factory.mktemp("rig")))
    plan = bench_plan(SURFACES[0], 0.0015)
    return plan, rig, make_candidates(plan, rig)


def test_start_has_three_mirrors_and_spreads(setting):
    _, _, candidates = setting
    places = uniform_start(candidates.directions, 16)
    chosen = candidates.directions[np.array(places)]
    assert len(set(places)) == 16
    assert np.sum(mirror_angles(chosen) < 1e-6) >= 3
    assert len(np.unique(chosen.theta_i)) >= 3


def test_points_keep_their_distance(setting):
    plan, _, candidates = setting
    picks = Picks(candidates, 2.0, [100])
    picks.take_farthest(20)
    for place in picks.chosen:
        others = [p for p in [100, *picks.chosen] if p != place]
        assert apart(candidates.directions, place)[others].min() >= 2.0 - 1e-6
    assert plan.adaptive.separation > 0.0


def test_the_same_rows_lead_to_the_same_point(setting):
    """A planner that is told all rows at once asks for what one told row by row asked for: noise and all."""
    plan, rig, candidates = setting
    observer = SimulatedLight(SURFACES[0], plan, rig, 3)

    def planner():
        return AdaptivePlanner(plan.adaptive, candidates, rig, observer, lambda *said: None)

    whole, rows, asked = planner(), [], []
    while (target := whole.ask()) is not None:
        asked.append(target)
        rows.append(observer.row(target.number, target.nominal))
        whole.tell(rows[-1])
    assert len(rows) < 100
    for count in (1, 17, 23, 24, len(rows) - 1, len(rows)):
        again = planner()
        for row in rows[:count]:
            again.tell(row)
        target = again.ask()
        if count == len(rows):
            assert target is None
            continue
        assert np.array_equal(target.nominal, asked[count].nominal)
        assert np.array_equal(target.axes, asked[count].axes)

"""What the detector sees: weighted sums over nodes, and the forward model on them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf import Directions
from clbrdf.errors import InputError
from clbrdf.models import get_model
from clbrdf.observation import ForwardModel, Observation
from tests.reference import naive


def random_observation(counts, seed):
    """Nodes with random angles, so many for each direction, and random weights."""
    rng = np.random.default_rng(seed)
    total = int(sum(counts))
    nodes = Directions.relative(
        rng.uniform(0, 80, total), rng.uniform(0, 80, total), rng.uniform(0, 360, total)
    )
    return Observation(nodes, np.repeat(np.arange(len(counts)), counts), rng.uniform(-0.5, 1.5, total))


@given(st.lists(st.integers(1, 7), min_size=1, max_size=12), st.integers(0, 99))
def test_sums_are_those_of_a_plain_loop(counts, seed):
    observation = random_observation(counts, seed)
    d = observation.nodes
    values = naive.brdf(naive.TIN_FOIL, d.theta_i, d.theta_r, d.phi)
    expected = np.zeros(len(counts))
    for k, (owner, weight) in enumerate(zip(observation.owner, observation.weight, strict=True)):
        expected[owner] += weight * values[k]
    model = get_model("wang2013")
    p = np.array(naive.TIN_FOIL)
    seen = ForwardModel.of(model, observation).brdf(p[None, :])
    # The naive values themselves are good to 1e-9; terms of both signs add up.
    np.testing.assert_allclose(seen, expected, rtol=1e-8, atol=1e-8 * np.abs(values).max())


@given(st.lists(st.integers(1, 5), min_size=2, max_size=9), st.integers(0, 99))
def test_a_part_is_seen_as_in_the_whole(counts, seed):
    observation = random_observation(counts, seed)
    model = get_model("ggx+lambert")
    whole = ForwardModel.of(model, observation)
    places = np.random.default_rng(seed).permutation(len(counts))[: max(1, len(counts) // 2)]
    p = model.defaults[None, None, :]
    # Added up in the same order, so equal to the last bit.
    for part in (whole.take(places), ForwardModel.of(model, observation.take(places))):
        np.testing.assert_array_equal(part.brdf(p), whole.brdf(p)[..., places])
        np.testing.assert_array_equal(part.jacobian(p), whole.jacobian(p)[..., places, :])


@pytest.mark.parametrize("name", ["ggx+lambert", "abg+lambert", "wang2013", "hapke"])
def test_the_jacobian_is_the_slope_of_what_is_seen(name):
    model = get_model(name)
    seen = ForwardModel.of(model, random_observation([3, 1, 6, 2], 5))
    p = model.defaults
    jacobian = seen.jacobian(p[None, :])
    for j in range(len(p)):
        step = 1e-6 * max(abs(p[j]), 1e-3)
        up, down = p.copy(), p.copy()
        up[j], down[j] = up[j] + step, down[j] - step
        slope = (seen.brdf(up[None, :]) - seen.brdf(down[None, :])) / (2.0 * step)
        # Central differences: 1e-12 of curvature, 1e-10 of rounding.
        np.testing.assert_allclose(jacobian[:, j], slope, rtol=1e-5, atol=1e-7 * np.abs(slope).max() + 1e-12)


def test_points_cost_nothing():
    model = get_model("ggx+lambert")
    directions = Directions.relative(30.0, np.arange(80.0), 180.0)
    seen = ForwardModel.of(model, Observation.points(directions))
    assert seen.first is None
    assert seen.weight is None
    p = model.defaults[None, :]
    np.testing.assert_array_equal(seen.brdf(p), model.brdf(p, model.features(directions)))


def test_mirror_images_become_one_node():
    nodes = Directions.relative(30.0, [40.0, 41.0, 41.0, 42.0], [180.0, 170.0, 190.0, 180.0], 20.0)
    observation = Observation(nodes, [0, 0, 0, 1], [0.5, 0.25, 0.25, 1.0])
    seen = ForwardModel.of(get_model("ggx+lambert"), observation)
    assert len(seen.features) == 3
    np.testing.assert_array_equal(seen.weight, [0.5, 0.5, 1.0])
    # A surface with a direction of its own tells them apart.
    assert len(ForwardModel.of(get_model("ggx_anisotropic"), observation).features) == 4


@pytest.mark.parametrize(
    ("owner", "weight", "words"),
    [
        ([0, 1], [1.0, 1.0, 1.0], "owners of shape"),
        ([0, 2, 2], [1.0, 1.0, 1.0], "count the measured directions"),
        ([0, 1, 0], [1.0, 1.0, 1.0], "count the measured directions"),
        ([0, 0, 1], [1.0, np.nan, 1.0], "finite"),
    ],
)
def test_what_is_no_observation(owner, weight, words):
    with pytest.raises(InputError, match=words):
        Observation(Directions.relative(30.0, [1.0, 2.0, 3.0], 0.0), owner, weight)

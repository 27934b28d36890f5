"""Lengths of values on the three scales."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf import InputError
from clbrdf.viz.colour_bar import value_paint
from clbrdf.viz.radius import RadiusScale, common_scale, make_scale, nice_step, steps_125

VALUES = np.array([0.4, 3.0, 600.0])


def test_linear_cosine_log():
    assert make_scale("linear", VALUES, 1.0).length(300.0, 0.2) == pytest.approx(0.5)
    cosine = make_scale("cosine", VALUES, [1.0, 1.0, 0.5])
    assert cosine.top == 300.0
    assert cosine.length(600.0, 0.5) == pytest.approx(1.0)
    log = RadiusScale("log", 1000.0, 0.1)
    np.testing.assert_allclose(log.length([0.1, 1.0, 1000.0, 0.001], 1.0), [0.0, 0.25, 1.0, 0.0], atol=1e-12)


def test_the_floor_lies_below_the_smallest_value_and_is_named():
    scale = make_scale("log", VALUES, 1.0)
    assert 0.0 < scale.floor < 0.4
    assert f"from {scale.floor:g} 1/sr" in scale.title
    assert make_scale("log", [1e-12, 100.0], 1.0).floor >= 1e-3 * 100.0 / 100.0 / 10.0
    with pytest.raises(InputError, match="floor of the logarithmic radius is 700"):
        make_scale("log", VALUES, 1.0, floor=700.0)


def test_values_without_bounds_end_at_the_top():
    scale = make_scale("linear", [1.0, np.inf, np.nan], 1.0)
    assert scale.top == 1.0
    np.testing.assert_array_equal(scale.length([np.inf, np.nan, -np.inf], 1.0), [1.0, 0.0, 0.0])


@pytest.mark.parametrize("nothing", [[], [0.0, -1.0], [np.nan]])
def test_nothing_to_scale(nothing):
    assert make_scale("log", nothing, 1.0).top == 1.0


@given(top=st.floats(1e-6, 1e6))
def test_ticks(top):
    step = nice_step(top)
    assert 3.0 - 1e-6 <= top / step < 7.6
    for mode in ("linear", "log", "cosine"):
        ticks = RadiusScale(mode, top, 1e-3 * top).ticks()
        places = [place for place, _ in ticks]
        assert 2 <= len(ticks) <= 8
        assert places == sorted(places)
        assert places[0] >= -1e-12
        assert places[-1] <= 1.0 + 1e-9
        for place, label in ticks:
            assert RadiusScale(mode, top, 1e-3 * top).length(float(label), 1.0) == pytest.approx(
                place, abs=2e-3
            )


def test_steps_and_joining():
    assert steps_125(0.09, 1.1) == pytest.approx([0.1, 0.2, 0.5, 1.0])
    both = common_scale([RadiusScale("log", 5.0, 0.1), RadiusScale("log", 50.0, 1.0)])
    assert (both.top, both.floor) == (50.0, 0.1)
    with pytest.raises(InputError, match="no radius is called 'cubic'"):
        make_scale("cubic", VALUES, 1.0)


def test_paint_runs_from_the_floor_to_the_top_and_differences_from_minus_to_plus():
    paint = value_paint(0.1, 1000.0, signed=False)
    np.testing.assert_allclose(
        paint.position([0.1, 10.0, 1000.0, 1e9, np.nan]), [0, 0.5, 1, 1, 0], atol=1e-12
    )
    signed = value_paint(0.1, 2.0, signed=True)
    np.testing.assert_allclose(signed.position([-2.0, 0.0, 2.0]), [0.0, 0.5, 1.0])
    left, middle, right = signed(np.array([-2.0, 0.0, 2.0])).astype(int)
    assert middle.min() > 225  # nearly white
    assert left[2] > left[0]  # bluish below
    assert right[0] > right[2]  # brownish above

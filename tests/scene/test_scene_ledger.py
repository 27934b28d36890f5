"""The ledger's account, and what a tolerance leaves out."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.scene import simulate
from clbrdf.scene.ledger import Entry, Ledger, keep_ledger
from clbrdf.scene.reduce import TRIED, negligible, reduce_scene, tried_places
from clbrdf.scene.scenefile import EFFECTS
from clbrdf.scene.simulate import set_up, values_of
from tests.scene.scenes import scene

GRID = {
    "theta_i": [30, 60],
    "theta_r": {"start": 0, "stop": 80, "step": 4},
    "wavelength": {"start": 400, "stop": 700, "step": 20},
    "surface": {"parameters": {"ks": {"polynomial": [400, 1.0], "centre": 550}}},
}


def test_moves_are_those_of_the_effects():
    """Two factors, known in closed form: 1 + drift · t, and the share of a spot that is seen."""
    effects = {"lamp_drift": {"per_hour": 0.36, "interval": 10}, "footprint": {"beam": 10, "field": 5}}
    made = scene(**GRID, effects=effects)
    ledger = keep_ledger(set_up(made))
    n = len(set_up(made).nominal)
    drift = 0.001 * np.arange(n)
    assert ledger.effects["lamp_drift"].largest == pytest.approx(drift.max(), rel=1e-9)
    assert ledger.effects["lamp_drift"].rms == pytest.approx(np.sqrt(np.mean(drift**2)), rel=1e-9)
    # Seen from the normal at θi = 60°: a circle of 5 in an ellipse of 10 × 20.
    assert ledger.effects["footprint"].largest == pytest.approx(1 - 25 / 200, rel=1e-9)
    assert ledger.values == n * 16


def test_moves_of_integrals_are_those_of_the_values():
    made = scene(**GRID, effects={"aperture": {"angle": 2}, "bandwidth": {"width": 10}})
    ledger = keep_ledger(set_up(made))
    plain, cone, both = (
        values_of(set_up(scene(**GRID, effects=on)))
        for on in ({}, {"aperture": {"angle": 2}}, {"aperture": {"angle": 2}, "bandwidth": {"width": 10}})
    )
    assert ledger.effects["aperture"].largest == pytest.approx(np.abs(cone / plain - 1).max(), rel=1e-6)
    assert ledger.effects["bandwidth"].largest == pytest.approx(np.abs(both / cone - 1).max(), rel=1e-6)


def test_parts_add_up_to_the_whole():
    """All effects on; medians of three, since neighbours on the machine may spoil one."""
    made = scene(**GRID, rtol=1e-3, effects=dict.fromkeys(EFFECTS, True))
    ratios = []
    for _ in range(3):
        ledger = keep_ledger(set_up(made))
        assert tuple(ledger.effects) == EFFECTS
        ratios.append(ledger.parts / ledger.whole)
    assert 0.8 < sorted(ratios)[1] < 1.2


def test_all_off():
    ledger = keep_ledger(set_up(scene(**GRID)))
    assert ledger.effects == {}
    assert ledger.counts == 0.0


def test_values_that_are_zero_or_missing_are_left_aside():
    entry = Entry("x")
    entry.compare(np.array([0.0, np.nan, 1.0, 2.0]), np.array([1.0, 1.0, np.inf, 2.2]))
    assert entry.largest == pytest.approx(0.1)
    assert entry.rms == pytest.approx(0.1)


def test_least_first_while_their_sum_fits():
    moves = {"a": 0.4, "b": 0.01, "c": 0.2, "d": 0.0}
    ledger = Ledger(1.0, {name: Entry(name, largest=move) for name, move in moves.items()}, 0.0, 1.0, 1)
    assert negligible(ledger, 0.3) == ("d", "b", "c")
    assert negligible(ledger, 0.2) == ("d", "b")
    assert negligible(ledger, 0.0) == ("d",)


@pytest.mark.parametrize("rtol", [3e-2, 1e-3])
def test_a_tolerance_is_kept_and_said(rtol):
    effects = {
        "aperture": {"angle": 2},
        "bandwidth": {"width": 2.4},
        "lamp_drift": {"per_hour": 0.01},
        "nonlinearity": True,
        "saturation": True,
    }
    made = scene(**GRID, rtol=1e-6, effects=effects)
    whole, reduced = simulate(made).brdf, reduce_scene(set_up(made), rtol)
    words = " ".join(reduced.words)
    on = reduced.setting.scene.effects.on()
    assert "saturation" not in on
    assert "left out saturation: it moves the result by 0 at most" in words
    assert "arithmetic: precision fast" in words or "arithmetic: precision single" in words
    assert "aperture" in on
    assert f"integrated to {rtol / 4:.2g}, not 1e-06" in words
    np.testing.assert_allclose(values_of(reduced.setting), whole, rtol=rtol)


def test_a_fine_tolerance_leaves_everything():
    made = scene(**GRID, rtol=1e-8, effects={"lamp_drift": True, "reader": True})
    reduced = reduce_scene(set_up(made), 1e-9)
    assert reduced.setting.scene == made
    with pytest.raises(InputError, match="the best here"):
        reduce_scene(set_up(made), 1e-14)


def test_tried_directions_hold_the_mirror_direction():
    ready = set_up(scene([30, 45], {"start": 0, "stop": 85, "step": 1}, phi_r=[0, 90, 180]))
    places = tried_places(ready)
    assert len(places) <= TRIED < len(ready.nominal)
    d = ready.nominal[places]
    for angle in (30.0, 45.0):
        assert ((d.theta_i == angle) & (d.theta_r == angle) & (d.phi == 180.0)).any()

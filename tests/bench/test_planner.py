"""`clbrdf bench planner`: its plans on emulated rigs are the ones in simulated light."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.bench.emulated_plans import EmulatedPlan, emulated_plans, measure_on_rig, plan_text, rig_text
from clbrdf.bench.planner import NOISE, SURFACES, TARGETS, bench_plan
from clbrdf.rig.planfile import load_plan
from clbrdf.rig.rigfile import load_rig


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.name)
def test_files_say_what_the_plans_in_simulated_light_do(tmp_path, surface):
    (tmp_path / "rig.toml").write_text(rig_text(surface, 3))
    rig = load_rig(tmp_path / "rig.toml")
    assert rig.emulator.model == surface.model
    assert {n: curve.polynomial for n, curve in rig.emulator.parameters.items()} == {
        n: (value,) for n, value in surface.parameters.items()
    }
    # A point's power is the mean of two medians of three readings.
    draws = np.random.default_rng(1).standard_normal((2, 3, 100_000)) * rig.reference.noise
    assert 100.0 * np.median(draws, axis=1).mean(axis=0).std() == pytest.approx(NOISE, rel=0.01)
    (tmp_path / "plan.toml").write_text(plan_text(EmulatedPlan(surface, "adaptive", TARGETS[1], 3), 0))
    plan, wanted = load_plan(tmp_path / "plan.toml"), bench_plan(surface, TARGETS[1])
    assert plan.adaptive == wanted.adaptive
    assert (plan.theta_i, plan.theta_r, plan.azimuths()) == (
        wanted.theta_i,
        wanted.theta_r,
        wanted.azimuths(),
    )
    (tmp_path / "plan.toml").write_text(plan_text(EmulatedPlan(surface, "uniform", TARGETS[1], 3), 140))
    spread = load_plan(tmp_path / "plan.toml").directions()
    assert len(spread.theta_r) == 140
    steps = np.diff(np.unique(spread.theta_r))
    assert steps == pytest.approx(80.0 / 14.0, abs=2e-6)


def test_every_plan_comes_once():
    plans = list(emulated_plans(3))
    assert len(plans) == len({(p.surface.name, p.way, p.target, p.seed) for p in plans}) == 3 * 12 - 1


@pytest.mark.soak
def test_the_rig_gives_what_simulated_light_gives(tmp_path):
    """To the coarse target the start of 16 points is enough."""
    surface = SURFACES[0]
    run = measure_on_rig(EmulatedPlan(surface, "adaptive", TARGETS[0], 5), tmp_path)
    assert run.points == 16
    assert run.reached < TARGETS[0]
    assert abs(run.z) < 5.0

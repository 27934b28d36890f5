"""Plan, rig and budget files: what is read, and one clear line for what cannot be."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_helpers import write_plan, write_rig

from clbrdf.errors import InputError
from clbrdf.rig.budget import load_budget
from clbrdf.rig.planfile import Plan, load_plan
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.route import plan_route
from clbrdf.rig.samples import sample_path
from clbrdf.rig.segmentimage import lookup3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("theta_i = [30, 95]\ntheta_r = 0", r"theta_i: 95°; zenith angles lie in \[0°, 90°\)"),
        ("theta_i = 30\ntheta_r = -5", r"theta_r: -5°; zenith angles lie in"),
        ("theta_i = 30\ntheta_r = 90", r"theta_r: 90°"),
        ("theta_i = 30\ntheta_r = 10\nphi_r = 1e4", r"phi_r: 10000°; azimuths lie in"),
        ("theta_i = 30\ntheta_r = nan", "theta_r"),
        ("theta_i = 30\ntheta_r = []", "theta_r is empty: the plan has no points"),
        ("theta_i = 30", "theta_r is missing"),
        ("", "theta_i is missing"),
        ("theta_i = 30\ntheta_r = 10\nthetar = 3", "unknown key thetar; did you mean theta_r?"),
        ("theta_i = 30\ntheta_r = 10\nzzz = 3", "unknown key zzz; known here: theta_i, theta_r"),
        (
            "theta_i = 30\ntheta_r = 10\nwavelength = {begin = 3}",
            "unknown key wavelength.begin; known here: start, stop, step",
        ),
        ("theta_i = 30\ntheta_r = {start = 0, stop = 10}", "a range has the keys start, stop and step"),
        (
            "theta_i = 30\ntheta_r = {start = 0, stop = 10, step = -1}",
            "from 0 to 10 is empty in steps of -1",
        ),
        ("theta_i = 30\ntheta_r = {start = 0, stop = 10, step = 0}", "in steps of 0 has no end"),
        ("theta_i = 30\ntheta_r = {start = 0, stop = 80, step = 1e-6}", "at most 1000000"),
        ("theta_i = 30\ntheta_r = 10\nphi_r = 90", "phi_r - phi_i = 90° is out of plane"),
        ("theta_i = 30\ntheta_r = 10\nrepeats = 0", "repeats = 0: should be greater than or equal to 1"),
        ("theta_i = 30\ntheta_r = 10\nintegration_time = 100.0", "integration_time"),
        ("theta_i = 30\ntheta_r = 10\nregion = 'sideways'", "region = 'sideways': should be 'in-plane' or"),
        ("theta_i = 30\ntheta_r = 10\nshortest_time = 2.0\nlongest_time = 1.0", "longest_time 1 s is below"),
        ("theta_i = 30\ntheta_r = 10\nwavelength = {start = 700, stop = 400}", "stop 400 nm lies below"),
        ("theta_i = = 3", "not TOML"),
    ],
)
def test_bad_plans(tmp_path, text, words):
    path = tmp_path / "plan.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        load_plan(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("limits = [-95, 95]", "limits = [95, -95]", r"stages.turn: limits are \[95, -95\]; give the lower"),
        (
            "limits = [-95, 95]",
            "limits = [5, 95]",
            r"stages.turn: limits \[5, 95\] leave out the home position",
        ),
        (
            "limits = [-95, 95]",
            "limits = [-80, 80]",
            r"geometry.direct puts turn at 90°, outside stages.turn.l",
        ),
        ("address = 2", "address = 1", r"addresses are \[1, 1, 3\]; each stage needs its own"),
        ("address = 2", "address = 40", "stages.turn.address = 40"),
        ("sign = -1", "sign = 0", "sign is 0; give 1 or -1"),
        ('"ports/reference"', '"ports/stages"', "each instrument needs its own line"),
        ("solid_angle = 1.0e-3", "", "geometry.solid_angle is missing"),
        ("solid_angle = 1.0e-3", "solid_angle = 0", "geometry.solid_angle = 0"),
        ("bias = 1500", "bais = 1500", "unknown key spectrometer.bais; did you mean bias?"),
        (
            "bias = 1500",
            'driver = "avaspec"',
            "no driver for spectrometer is called 'avaspec'; there are obp",
        ),
        ("bias = 1500", 'driver = "smc100"', "no driver for spectrometer is called 'smc100'"),
        ("seed = 0", "parameters = {q = 3}", "no parameter 'q'"),
        ("seed = 0", 'faults = ["gremlin"]', "no fault is called 'gremlin'"),
        ("seed = 0", "parameters = {ks = [[500, 1.0], [400, 2.0]]}", "increasing wavelengths"),
        ("[emulator.effects]", "[emulator.effects]\nfog = true", "unknown key emulator.effects.fog"),
    ],
)
def test_bad_rigs(tmp_path, before, after, words):
    path = write_rig(tmp_path)
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(InputError, match=words) as caught:
        load_rig(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[personal]]\nname = 'x'\npercent = -1", r"personal\[0\].percent = -1"),
        ("[[personal]]\nname = 'x'", r"personal\[0\].percent is missing"),
        ("[[persons]]\nname = 'x'", "unknown key persons; did you mean personal?"),
        ("[points]\nangel = 1", "unknown key points.angel; did you mean angle?"),
    ],
)
def test_bad_budgets(tmp_path, text, words):
    path = tmp_path / "budget.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        load_budget(path)


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_plan(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe\0")
    with pytest.raises(InputError, match="cannot be read as text"):
        load_plan(tmp_path / "bad.toml")
    with pytest.raises(InputError, match="cannot be read"):
        load_plan(tmp_path)


def test_samples_are_good():
    load_budget(sample_path("budget.toml"))
    route = plan_route(load_plan(sample_path("plan.toml")), load_rig(sample_path("rig.toml")))
    assert len(route) == 54
    assert route.unreachable == {}


def test_directions_of_a_plan():
    plan = Plan(theta_i=[30], theta_r=[0, 10], phi_r=[0, 180])
    d = plan.directions()
    # θr = 0 has no azimuth: one point, not two.
    assert list(zip(d.theta_r, d.phi, strict=True)) == [(0.0, 180.0), (10.0, 0.0), (10.0, 180.0)]


def test_equal_azimuth_differences_are_measured_once():
    plan = Plan(theta_i=[30], theta_r=[10], phi_i=[0, 20], phi_r=[180, 200], region="hemispherical")
    assert plan.azimuths() == [180.0, 200.0, 160.0]
    default = Plan(theta_i=[30], theta_r=[10], region="hemispherical")
    assert len(default.directions()) == 24


@given(st.lists(st.floats(0, 84.9), min_size=1, max_size=6), st.integers(1, 3))
def test_route_keeps_every_reachable_point(tmp_path_factory, theta_r, repeats):
    rig = load_rig(sample_path("rig.toml"))
    plan = Plan(theta_i=[20.0, 60.0], theta_r=theta_r, phi_r=[0, 180], repeats=repeats)
    route = plan_route(plan, rig)
    d = plan.directions()
    assert route.planned == len(d) * repeats
    assert len(route) + sum(route.unreachable.values()) == route.planned
    wanted = set(zip(d.theta_i, d.theta_r, d.phi, strict=True))
    taken = list(zip(route.directions.theta_i, route.directions.theta_r, route.directions.phi, strict=True))
    assert set(taken) <= wanted
    assert all(taken.count(one) == repeats for one in set(taken))


def test_unreachable_directions_are_named(tmp_path):
    rig = load_rig(write_rig(tmp_path))
    plan = Plan(theta_i=[30], theta_r=[0, 27, 30, 33, 86], phi_r=[0, 180])
    route = plan_route(plan, rig)
    assert route.unreachable == {
        "behind the lamp, nearer than 5° to it": 3,
        "beyond the holder's rim at 85°": 2,
    }
    path = write_rig(tmp_path)
    path.write_text(path.read_text().replace("limits = [-90, 90]", "limits = [-10, 10]"))
    plan = Plan(theta_i=[60], theta_r=[60], phi_r=[90, 180], region="hemispherical")
    assert plan_route(plan, load_rig(path)).unreachable == {"outside the limits of pitch": 1}


def test_nothing_reachable(tmp_path):
    rig = load_rig(write_rig(tmp_path))
    with pytest.raises(InputError, match="none of the 2 directions can be reached: 2 beyond the holder"):
        plan_route(Plan(theta_i=[30], theta_r=[86, 87], phi_r=180), rig)


def test_shortest_order_travels_less(tmp_path):
    rig = load_rig(write_rig(tmp_path))
    angles = np.random.default_rng(3).permutation(np.arange(0, 85, 5.0)).tolist()
    given_order = plan_route(Plan(theta_i=[30, 60], theta_r=angles, phi_r=180, order="given"), rig)
    shortest = plan_route(Plan(theta_i=[30, 60], theta_r=angles, phi_r=180), rig)
    assert given_order.directions.theta_r[: len(angles)].tolist() == angles

    def travel(route):
        return np.abs(np.diff(route.axes, axis=0)).max(axis=1).sum()

    assert travel(shortest) < 0.3 * travel(given_order)
    assert shortest.seconds < given_order.seconds


def test_plan_file_in_full(tmp_path):
    plan = load_plan(write_plan(tmp_path, step=20.0, time=0.25, more="repeats = 2"))
    assert plan.theta_r == (0.0, 20.0, 40.0, 60.0)
    assert plan.integration_time == 0.25
    assert plan.repeats == 2


def test_raw_positions_follow_zero_and_sign(tmp_path):
    rig = load_rig(write_rig(tmp_path))
    assert rig.stages.lamp.to_raw(30.0) == 40.0
    assert rig.stages.lamp.from_raw(40.0) == 30.0
    assert rig.stages.turn.to_raw(30.0) == -30.0
    assert rig.stages.lamp.raw_limits == (-170.0, 191.0)
    assert rig.stages.turn.raw_limits == (-95.0, 95.0)
    assert re.fullmatch(r".*ports/stages", rig.stages.port)


@pytest.mark.parametrize(
    ("key", "value"), [(b"", 0xDEADBEEF), (b"Four score and seven years ago", 0x17770551)]
)
def test_checksum_of_the_superblock(key, value):
    """The test values that stand in Bob Jenkins' lookup3.c (driver5)."""
    assert lookup3(key) == value

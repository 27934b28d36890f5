"""Kinematics against vectors turned by rotation matrices, and the round trip by properties."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clbrdf.geometry import Directions
from clbrdf.rig.kinematics import forward, inverse

zenith = st.floats(0.01, 89.99)
azimuth = st.floats(0.0, 360.0, exclude_max=True)
axis = st.floats(-179.0, 179.0)


def rotation(axis, degrees):
    """Rotation matrix by Rodrigues' formula."""
    k = np.asarray(axis, float)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    a = np.deg2rad(degrees)
    return np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross


def seen(direction, turn, pitch):
    """Zenith and azimuth of a direction in the sample's frame, by turning vectors."""
    body = rotation([0, 0, 1], turn) @ rotation([0, -1, 0], pitch)
    normal, e1, e2 = body @ [1, 0, 0], body @ [0, 1, 0], body @ [0, 0, 1]
    across = np.array([direction @ e1, direction @ e2])
    theta = np.rad2deg(np.arctan2(np.linalg.norm(across), direction @ normal))
    return theta, np.rad2deg(np.arctan2(across[1], across[0])) % 360.0


def apart(a, b):
    return abs((a - b + 180.0) % 360.0 - 180.0)


@given(axis, axis, st.floats(-89.0, 89.0))
def test_forward_agrees_with_rotation_matrices(lamp, turn, pitch):
    pose = forward(np.array([[lamp, turn, pitch]]))
    source = rotation([0, 0, 1], lamp) @ [1.0, 0.0, 0.0]
    for name, direction in (("i", source), ("r", np.array([1.0, 0.0, 0.0]))):
        theta, phi = seen(direction, turn, pitch)
        assert getattr(pose, f"theta_{name}")[0] == pytest.approx(theta, abs=1e-6)
        if 0.01 < theta < 179.99:
            assert apart(getattr(pose, f"phi_{name}")[0], phi) < 1e-6


@settings(max_examples=2000)
@given(zenith, zenith, azimuth)
def test_round_trip(theta_i, theta_r, phi):
    axes = inverse(Directions.relative(np.array([theta_i]), np.array([theta_r]), np.array([phi])))
    # Where the lamp would stand in front of the detector nothing is measured.
    assume(axes[0, 0, 0] > 1.0)
    for branch in range(2):
        pose = forward(axes[:, branch])
        assert abs(pose.theta_i[0] - theta_i) <= 1e-9
        assert abs(pose.theta_r[0] - theta_r) <= 1e-9
        assert apart(pose.phi_r[0] - pose.phi_i[0], phi) <= 1e-9


@given(st.floats(2.0, 178.0), st.floats(-80.0, 80.0), st.floats(-80.0, 80.0))
def test_the_other_way_round(lamp, turn, pitch):
    """Axes to directions and back: one of the two solutions is where the axes were."""
    axes = np.array([lamp, turn, pitch])
    pose = forward(axes[None])
    assume(0.1 < pose.theta_i[0] < 89.9)
    assume(0.1 < pose.theta_r[0] < 89.9)
    found = inverse(Directions.relative(pose.theta_i, pose.theta_r, pose.phi_r - pose.phi_i))
    # Azimuths next to the normal say little about the axes: compare where they do.
    assert np.abs(found[0, 0] - axes).max() < 1e-7


@given(zenith, zenith, azimuth)
def test_second_solution_turns_the_sample_by_half_a_turn(theta_i, theta_r, phi):
    axes = inverse(Directions.relative(np.array([theta_i]), np.array([theta_r]), np.array([phi])))
    assume(axes[0, 0, 0] > 1.0)
    assert np.array_equal(axes[0, 1], -axes[0, 0])
    first, second = forward(axes[:, 0]), forward(axes[:, 1])
    assert apart(first.phi_i[0] - second.phi_i[0], 180.0) < 1e-7


def test_mirror_geometry_by_hand():
    axes = inverse(Directions.relative(np.array([30.0]), np.array([30.0]), np.array([180.0])))
    assert axes[0, 0] == pytest.approx([60.0, 30.0, 0.0], abs=1e-12)
    # Out of plane by 90° at 45°/45°: cos α = 1/2, n = (cos 45°, tan 30° cos 45°, −√(1 − …)).
    axes = inverse(Directions.relative(np.array([45.0]), np.array([45.0]), np.array([90.0])))
    assert axes[0, 0, 0] == pytest.approx(60.0, abs=1e-12)
    assert np.cos(np.deg2rad(axes[0, 0, 1])) * np.cos(np.deg2rad(axes[0, 0, 2])) == pytest.approx(
        np.sqrt(0.5)
    )


def test_source_in_the_line_of_sight_has_no_solution():
    axes = inverse(Directions.relative(np.array([0.0, 30.0]), np.array([0.0, 30.0]), np.array([0.0, 0.0])))
    assert np.isnan(axes[..., 0]).all()

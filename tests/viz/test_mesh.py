"""The mesh of a lobe against spherical geometry."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clbrdf import InputError
from clbrdf.viz.directions import angles_of, unit_vectors
from clbrdf.viz.mesh import LobeMesh, whole

zeniths = st.floats(0.0, 85.0)


def whole_vectors(mesh: LobeMesh, theta_i: float) -> np.ndarray:
    """All points of the mesh on the unit sphere, (R + 1, 2S, 3)."""
    out = np.zeros((mesh.rings + 1, 2 * mesh.sectors, 3), np.float32)
    for axis in range(3):
        whole(mesh.views(theta_i)[axis], out[..., axis], odd=axis == 1)
    return out.astype(float)


@given(theta=st.floats(0.1, 89.0), phi=st.floats(0.0, 359.9))
def test_directions_there_and_back(theta, phi):
    back = angles_of(3.0 * unit_vectors(theta, phi))
    np.testing.assert_allclose(back[0], theta, atol=1e-9)
    assert abs((back[1] - phi + 180.0) % 360.0 - 180.0) < 1e-7


def test_forward_is_x_and_the_source_stands_on_the_other_side():
    np.testing.assert_allclose(
        unit_vectors(90.0, [0.0, 90.0, 180.0]), [[-1, 0, 0], [0, -1, 0], [1, 0, 0]], atol=1e-12
    )


@given(theta_i=zeniths, width=st.floats(1e-4, 0.5))
def test_middle_rim_and_gamma(theta_i, width):
    mesh = LobeMesh(width)
    x, y, z, sin2 = mesh.views(theta_i).astype(float)
    mirror = [np.sin(np.deg2rad(theta_i)), 0.0, np.cos(np.deg2rad(theta_i))]
    np.testing.assert_allclose([x[0, 0], y[0, 0], z[0, 0]], mirror, atol=1e-6)
    np.testing.assert_allclose(np.rad2deg(np.arccos(z[-1])), 85.0, atol=2e-4)
    assert (z >= np.cos(np.deg2rad(85.0)) - 2e-6).all()
    np.testing.assert_allclose(x**2 + y**2 + z**2, 1.0, atol=1e-6)
    zenith, azimuth = angles_of(np.stack([x, y, z], axis=-1).reshape(-1, 3))
    i, r, phi = np.deg2rad(theta_i), np.deg2rad(zenith), np.deg2rad(azimuth)
    # Equation (10), squared and taken from 1.
    expected = (1.0 - np.cos(i) * np.cos(r) + np.sin(i) * np.sin(r) * np.cos(phi)) / 2.0
    np.testing.assert_allclose(sin2.ravel(), expected, atol=3e-7)


def test_a_lobe_of_a_tenth_of_a_degree_has_rings_inside_it():
    half = np.deg2rad(0.05)
    rho = 2.0 * np.arcsin(np.sqrt(LobeMesh(half).views(45.0)[3].astype(float)))
    assert (rho[1:] <= half).sum(axis=0).min() >= 6
    assert (np.diff(rho, axis=0) > 0.0).all()


def test_triangles_cover_the_cap_once():
    mesh = LobeMesh(0.05, rings=24, sectors=12)
    edges = Counter()
    for a, b, c in mesh.triangles.tolist():
        edges.update([(a, b), (b, c), (c, a)])
    # Seen from outside every inner edge is walked once each way; the middle ring is one point, repeated.
    middle = range(2 * mesh.sectors)
    names = Counter()
    for (a, b), n in edges.items():
        names[(0 if a in middle else a, 0 if b in middle else b)] += n
    rim = set(range(mesh.rings * 2 * mesh.sectors, mesh.size))
    for (a, b), n in names.items():
        assert n == 1
        assert (a in rim and b in rim) or names[(b, a)] == 1


@pytest.mark.parametrize("theta_i", [0.0, 30.0, 60.0, 84.0])
def test_solid_angle_of_the_mesh(theta_i):
    mesh = LobeMesh(0.05, rings=96, sectors=90)
    corners = whole_vectors(mesh, theta_i).reshape(-1, 3)[mesh.triangles]
    a, b, c = np.moveaxis(corners, 1, 0)
    # Van Oosterom and Strackee 1983; positive when the outside is counted anticlockwise.
    dot = (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)
    omega = 2.0 * np.arctan2((a * np.cross(b, c)).sum(1), 1.0 + dot)
    assert omega.min() > -1e-6
    np.testing.assert_allclose(omega.sum(), 2.0 * np.pi * (1.0 - np.cos(np.deg2rad(85.0))), rtol=2e-3)


def test_both_sides_of_the_plane_of_incidence_mirror_each_other():
    points = whole_vectors(LobeMesh(0.05, rings=8, sectors=6), 40.0)
    np.testing.assert_array_equal(points[:, 1], points[:, -1] * [1, -1, 1])
    assert (points[1:, 1, 1] > 0.0).all()


def test_the_plane_curve_lies_in_the_plane():
    mesh = LobeMesh(0.05, rings=8, sectors=6)
    curve = whole_vectors(mesh, 40.0).reshape(-1, 3)[mesh.plane_curve]
    assert len(curve) == 17
    np.testing.assert_allclose(curve[:, 1], 0.0, atol=1e-7)
    signed = np.rad2deg(np.arctan2(curve[:, 0], curve[:, 2]))
    assert (np.diff(signed) < 0.0).all()
    np.testing.assert_allclose(signed[[0, 8, -1]], [85.0, 40.0, -85.0], atol=1e-3)


def test_mistakes():
    with pytest.raises(InputError, match="limiting zenith is 90"):
        LobeMesh(0.1, 90.0)
    with pytest.raises(InputError, match="width of the lobe is 0 rad"):
        LobeMesh(0.0)
    with pytest.raises(InputError, match="incident zenith 86"):
        LobeMesh(0.1).views(86.0)

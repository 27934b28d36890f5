"""Surfaces: where their points are, what joins them, and which way they face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Directions, Scan, evaluate
from clbrdf.models import get_model
from clbrdf.viz.colour_bar import value_paint
from clbrdf.viz.directions import angles_of, unit_vectors
from clbrdf.viz.joined import joined_directions
from clbrdf.viz.lobes import FittedLobe, MeasuredLobe, reference_values
from clbrdf.viz.marks import Marks
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import peak_text, points_text
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.subject import Subject
from tests.planted import with_parameters
from tests.viz.conftest import FOIL, all_masked, fit_of

UNIT = RadiusScale("linear", 1.0, 1e-3)


def test_points_lie_at_radius_times_direction(foil):
    lobe = FittedLobe(foil, LobeMesh(0.03, rings=20, sectors=10))
    assert lobe.evaluate(1, 45.0)
    lobe.draw(RadiusScale("linear", 100.0, 1e-3), None)
    points = np.asarray(lobe.polydata.points, float)
    length = np.linalg.norm(points, axis=1)
    zenith = np.rad2deg(np.arccos(points[:, 2] / length))
    azimuth = np.rad2deg(np.arctan2(-points[:, 1], -points[:, 0]))
    # The points are placed in single precision, and the peak is steep.
    expected = evaluate(FOIL, 45.0, np.minimum(zenith, 89.9), azimuth)
    np.testing.assert_allclose(100.0 * length, expected, rtol=2e-3)
    np.testing.assert_allclose(100.0 * length[0], evaluate(FOIL, 45.0, 45.0, 180.0), rtol=1e-5)


def test_normals_point_outward_and_a_sphere_has_radial_ones(small_scan):
    sphere = Subject("white", small_scan, fit_of(small_scan, {**FOIL, "ks": 0.0, "kd": np.pi}))
    lobe = FittedLobe(sphere, LobeMesh(0.3, rings=60, sectors=40))
    lobe.evaluate(0, 30.0)
    lobe.draw(UNIT, None)
    points = np.asarray(lobe.polydata.points, float)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-5)
    normals = np.asarray(lobe.polydata.point_data["Normals"], float)
    cosine = (points * normals).sum(axis=1)
    inner = slice(0, -2 * lobe.mesh.sectors)  # one-sided differences at the rim
    assert cosine[inner].min() > 0.995
    assert cosine.min() > 0.9


def test_moving_writes_in_place(foil):
    lobe = FittedLobe(foil, LobeMesh(0.03, rings=20, sectors=10))
    lobe.evaluate(0, 45.0)
    lobe.draw(UNIT, value_paint(0.1, 600.0, False))
    data, faces = lobe.polydata.GetPoints().GetData(), lobe.polydata.GetPolys()
    before, changed = np.array(lobe.polydata.points), data.GetMTime()
    lobe.evaluate(2, 50.0)
    lobe.draw(UNIT, value_paint(0.1, 600.0, False))
    assert lobe.polydata.GetPoints().GetData() is data
    assert lobe.polydata.GetPolys() is faces
    assert data.GetMTime() > changed
    assert not np.allclose(before, lobe.polydata.points)


def test_no_fit_at_a_wavelength(foil):
    parameters = {n: np.array(v) for n, v in foil.fit.parameters.items()}
    for values in parameters.values():
        values[1] = np.nan
    subject = Subject("foil", foil.scan, with_parameters(foil.fit, parameters))
    lobe = FittedLobe(subject, LobeMesh(0.03, rings=20, sectors=10))
    assert not lobe.evaluate(1, 45.0)
    assert lobe.evaluate(2, 45.0)
    assert subject.default_wavelength() == 550.0  # measured, though not fitted
    assert not lobe.spectra()[..., 1].any()


def test_difference_of_two_fits(foil, small_scan):
    more = Subject("more", small_scan, fit_of(small_scan, {**FOIL, "kd": FOIL["kd"] + np.pi * 0.25}))
    exact = Subject("foil", small_scan, fit_of(small_scan, FOIL))
    lobe = FittedLobe(more, LobeMesh(0.03, rings=20, sectors=10), other=exact)
    assert lobe.evaluate(1, 45.0)
    # Values of 600 in single precision carry 4e-5.
    np.testing.assert_allclose(lobe.values, 0.25, atol=2e-4)
    swapped = FittedLobe(exact, LobeMesh(0.03, rings=20, sectors=10), other=more)
    swapped.evaluate(1, 45.0)
    np.testing.assert_allclose(swapped.values, -0.25, atol=2e-4)


def test_measured_minus_model(foil):
    lobe = MeasuredLobe(foil, foil)
    assert lobe.evaluate(0, 45.0)
    # The scan was made with the same parameters, scaled alike.
    np.testing.assert_allclose(lobe.values, 0.0, atol=1e-9)
    half = replace(foil.scan, brdf=0.5 * foil.scan.brdf)
    lobe = MeasuredLobe(Subject("half", half), foil)
    lobe.evaluate(0, 45.0)
    rows = foil.rows(45.0)
    np.testing.assert_allclose(np.sort(lobe.values), np.sort(-0.5 * foil.scan.brdf[rows, 0]), rtol=1e-9)


def test_two_scans_meet_in_their_common_directions(small_scan):
    ours = Subject("ours", small_scan)
    fewer = Scan([45.0, 45.0], 0.0, [15.0, 77.0], 180.0, [550.0], [[1.0], [2.0]])
    values = reference_values(Subject("theirs", fewer), ours, ours.rows(45.0), 1)
    assert np.isfinite(values).sum() == 1
    assert values[small_scan.theta_r[ours.rows(45.0)] == 15.0] == 1.0


def test_hemisphere_is_triangulated_and_closed_over_the_normal(hemisphere):
    lobe = MeasuredLobe(Subject("plaster", hemisphere))
    assert lobe.evaluate(0, 40.0)
    lobe.draw(UNIT, value_paint(0.2, 0.7, False))
    # 18 repeats of the normal are one point.
    assert len(lobe.values) == 1 + 8 * 18
    triangles, lines = joined_directions(np.asarray(lobe.vectors))
    assert len(lines) == 0
    assert triangles.min() == 0
    flat = np.asarray(lobe.vectors)[:, :2][triangles]
    (ax, ay), (bx, by), (cx, cy) = np.moveaxis(flat, 0, -1)
    area = 0.5 * np.abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)).sum()
    # An 18-sided polygon with corners at sin 80°.
    assert area == pytest.approx(9.0 * np.sin(np.deg2rad(20.0)) * np.sin(np.deg2rad(80.0)) ** 2, rel=1e-9)


def test_directions_in_a_plane_are_a_sheet_in_order():
    order = np.random.default_rng(3).permutation(15)
    zenith = np.linspace(-70.0, 70.0, 15)[order]
    vectors = unit_vectors(np.abs(zenith), np.where(zenith < 0.0, 0.0, 180.0))
    triangles, lines = joined_directions(vectors)
    assert len(triangles) == len(lines) == 14
    assert (triangles == -1).sum() == 14  # each has a corner at the origin
    np.testing.assert_allclose(np.abs(zenith[lines[:, 0]] - zenith[lines[:, 1]]), 10.0)


def test_one_direction_is_a_line_from_the_origin():
    lobe = MeasuredLobe(Subject("one", Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]])))
    assert lobe.evaluate(0, 45.0)
    lobe.draw(UNIT, value_paint(0.1, 1.0, False))
    assert lobe.polydata.n_lines == 1
    ends = np.asarray(lobe.polydata.points, float)
    np.testing.assert_allclose(sorted(np.linalg.norm(ends, axis=1)), [0.0, 0.5], rtol=1e-6)


def test_masked_values_make_no_surface(small_scan):
    subject = Subject("masked", all_masked(small_scan, 1))
    lobe = MeasuredLobe(subject)
    assert not lobe.evaluate(1, 45.0)
    assert lobe.evaluate(2, 45.0)
    # Spectra bridge what is masked.
    np.testing.assert_allclose(lobe.spectra()[:, 1], lobe.spectra()[:, [0, 2]].mean(axis=1), rtol=1e-12)


def test_marks_and_whiskers(gl, foil):
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True)
    higher = replace(foil.scan, brdf=1.2 * foil.scan.brdf)
    marks = Marks(plotter.renderer, Subject("foil", higher, replace(foil.fit, scan=higher)))
    marks.find(1, 45.0)
    marks.draw(RadiusScale("linear", 1000.0, 1e-3))
    assert marks.points.n_points == 16
    rows = foil.rows(45.0)
    length = np.linalg.norm(marks.positions, axis=1)
    np.testing.assert_allclose(length, higher.brdf[rows, 1] / 1000.0, rtol=1e-12)
    ends = np.linalg.norm(np.asarray(marks.whiskers.points, float), axis=1)
    np.testing.assert_allclose(ends[:16] / ends[16:], 1.2, rtol=1e-5)
    colours = np.asarray(marks.whiskers.point_data["colour"])
    assert (colours[:, 0] > colours[:, 2]).all()  # orange: measured above
    marks.find(1, 33.0)
    marks.draw(UNIT)
    assert marks.points.n_points == 0
    plotter.close()


def test_words(small_scan):
    subject = Subject("foil", small_scan)
    assert "not measured at θi = 33°" in points_text(subject, 33.0, 0, 0, 0)
    assert points_text(subject, 30.0, 14, 2, 14) == "14 measured points, 2 masked and not shown"
    text = peak_text([1.0, 5.0], unit_vectors([10.0, 85.0], [0.0, 180.0]), 85.0, False)
    assert text == "peak 5 1/sr at θr = 85.0°, φ = 180° (at the edge of the mesh)"
    assert peak_text([1.0, -5.0], unit_vectors([0.0, 20.0], 0.0), None, True).startswith(
        "largest difference -5"
    )


@pytest.fixture
def brushed(small_scan):
    """A lobe that is wide across and narrow along, measured at two incident azimuths, most at 60°."""
    phi_i = np.where(np.arange(len(small_scan)) % 3 == 0, 0.0, 60.0)
    scan = replace(small_scan, phi_i=phi_i, phi_r=180.0 + phi_i)
    model = get_model("ggx_anisotropic")
    values = {**{p.name: p.default for p in model.parameters}, "alpha_x": 0.05, "alpha_y": 0.4}
    fit = fit_of(scan, FOIL)
    parameters = {name: np.full(3, values[name]) for name in model.names}
    fit = with_parameters(replace(fit, model=model), parameters, parameters)
    return Subject("brushed", scan, fit)


def test_an_anisotropic_lobe_goes_all_around(brushed, device):
    """Every point of the mesh has the model's value at the incident azimuth that is shown."""
    lobe = FittedLobe(brushed, LobeMesh(0.1, rings=20, sectors=12, even=False), device)
    assert lobe.evaluate(1, 45.0)
    assert lobe.values.shape == (21, 24)
    zenith, azimuth = angles_of(lobe.vectors.reshape(-1, 3))
    fit = brushed.fit
    directions = Directions(45.0, 60.0, zenith, azimuth + 60.0)
    expected = fit.model.brdf(fit.vector[1][None], fit.model.features(directions)).reshape(21, 24)
    # Away from the mirror direction, where single precision angles decide.
    np.testing.assert_allclose(lobe.values, expected, rtol=1e-3, atol=1e-5 * expected.max())
    left, right = lobe.values[10, 1:12], lobe.values[10, :12:-1]
    assert np.abs(left / right - 1.0).max() > 0.1
    lobe.draw(RadiusScale("linear", float(lobe.values.max()), 1e-3), None)
    points, normals = (
        np.asarray(a).reshape(21, 24, 3) for a in (lobe.polydata.points, lobe.polydata.point_data["Normals"])
    )
    lengths = np.linalg.norm(points, axis=-1)
    np.testing.assert_allclose(
        lengths[:, :13] / lengths.max(), lobe.values[:, :13] / lobe.values.max(), atol=1e-3
    )
    # Normals point away from the origin where the surface does not fold back on itself.
    outward = (normals * points).sum(axis=-1)[1:-1]
    assert (outward > -1e-6).mean() > 0.95


def test_points_beside_an_anisotropic_lobe_share_its_azimuth(brushed):
    assert brushed.phi_i == 60.0
    rows = brushed.rows(45.0)
    assert (brushed.scan.phi_i[rows] == 60.0).all()
    assert 0 < len(rows) < 16

"""Sliders, keys and clicks, through the same calls that a window and a browser make."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf import evaluate
from clbrdf.viz.camera import project
from clbrdf.viz.cut import cut_angles
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.stills import pixels
from clbrdf.viz.style import LobeStyle
from clbrdf.viz.subject import Subject
from clbrdf.viz.window import KEYS, Window, controlled_picture
from tests.viz.conftest import FOIL

pytestmark = pytest.mark.usefixtures("gl")


@pytest.fixture
def control(foil):
    made = controlled_picture(
        [LobeRequest(foil, 550.0, 45.0)], LobeStyle(radius="log"), (800, 600), off_screen=True
    )
    made.picture.render()
    yield made
    made.picture.close()


def test_the_wavelength_stops_at_measured_ones(control):
    control.set_wavelength(630.0)
    assert control.wavelength == 650.0
    assert "λ = 650 nm" in control.picture.panels[0].caption()


@pytest.mark.parametrize(
    ("asked", "shown"), [(44.5, 45.0), (45.7, 45.0), (46.0, 46.0), (-3.0, 0.0), (99.0, 85.0)]
)
def test_the_incident_angle_jumps_to_measured_ones_that_are_near(control, asked, shown):
    control.set_incident(asked)
    assert control.theta_i == shown


def test_the_cut_follows(control):
    control.set_incident(60.0)
    curve, points = control.cut.series
    peak = evaluate(FOIL, 60.0, 60.0, 180.0)[0]
    assert curve[1].max() == pytest.approx(peak, rel=1e-3)
    assert curve[0][curve[1].argmax()] == pytest.approx(60.0, abs=0.1)
    assert len(points[0]) == 16
    control.set_incident(52.0)
    assert len(control.cut.series) == 1  # a curve, and nothing measured here
    control.next_radius()
    assert not control.cut.log


def test_the_cut_without_a_decade_in_it_is_labelled_in_values(hemisphere):
    """0.2 to 0.7 on a logarithmic axis: labels are BRDF, not its logarithm."""
    subject = Subject("plaster", hemisphere)
    made = controlled_picture(
        [LobeRequest(subject, 650.0, 40.0)], LobeStyle(radius="log"), (800, 600), off_screen=True
    )
    axis = made.cut.chart.y_axis
    assert len(axis.tick_labels) >= 3
    for place, label in zip(axis.tick_locations, axis.tick_labels, strict=True):
        assert 10.0**place == pytest.approx(float(label), rel=1e-3)
        assert 0.1 < float(label) < 1.2
    made.picture.close()


def test_cut_angles_are_close_together_at_the_peak():
    angles = cut_angles(45.0, 85.0, np.deg2rad(0.05))
    assert angles[0] == pytest.approx(-85.0)
    assert angles[-1] == pytest.approx(85.0)
    assert np.diff(angles).min() < 0.005
    assert (np.diff(angles) > 0).all()


def test_keys_change_radius_points_scale_and_view(control):
    picture = control.picture
    for expected in ("cosine", "linear", "log"):
        control.next_radius()
        assert picture.look.radius == expected
    control.next_colour()
    assert picture.look.colour == "value"
    assert "a colour needs a spectrum" in control.message
    with_points = pixels(picture).astype(int)
    control.toggle_points()
    without = pixels(picture).astype(int)
    assert np.abs(with_points - without).max() > 100
    control.toggle_points()
    np.testing.assert_array_equal(pixels(picture), with_points)
    control.toggle_hold()
    top = picture.scale.top
    control.set_incident(60.0)
    assert picture.scale.top == top
    control.toggle_hold()
    assert picture.scale.top > 2.0 * top
    control.set_incident(45.0)
    camera = picture.panels[0].renderer.camera
    camera.Azimuth(40.0)
    control.first_view()
    np.testing.assert_array_equal(pixels(picture), with_points)


def test_a_click_reads_out_a_measured_point(control, foil):
    panel = control.picture.panels[0]
    marks = panel.marks[0]
    place = int(np.abs(foil.scan.theta_r[marks.rows] - 40.0).argmin())
    x, y = project(panel.renderer, marks.positions)[place]
    text = control.pick(x + 3.0, y - 3.0)
    row = marks.rows[place]
    assert text.startswith("foil: θr = 40.00°, φ = 180.0°: measured")
    assert f"{foil.scan.brdf[row, 1]:.4g} ± {foil.scan.sigma[row, 1]:.2g} 1/sr" in text
    assert "residual +0.0 %" in text or "residual -0.0 %" in text
    assert control.message == text


def test_a_click_reads_out_the_surface(control):
    control.toggle_points()
    panel = control.picture.panels[0]
    direction = np.array([np.sin(np.deg2rad(43.5)), -0.03, np.cos(np.deg2rad(43.5))])
    direction /= np.linalg.norm(direction)
    zenith = np.rad2deg(np.arccos(direction[2]))
    azimuth = np.rad2deg(np.arctan2(-direction[1], -direction[0]))
    value = evaluate(FOIL, 45.0, zenith, azimuth)[0]
    position = direction * control.picture.scale.length(value, 1.0)
    x, y = project(panel.renderer, position)[0]
    text = control.pick(x, y)
    assert float(text.split("θr = ")[1].split("°")[0]) == pytest.approx(zenith, abs=1.0)
    found = float(text.split("model ")[1].split()[0])
    # One pixel is half a degree on a steep flank.
    assert found == pytest.approx(value, rel=0.25)


@pytest.mark.parametrize("place", [(3.0, 300.0), (700.0, 590.0), (250.0, 120.0)])
def test_a_click_beside_everything_says_nothing(control, place):
    assert control.pick(*place) == ""


class TestWindow:
    """VTK's own events, off screen."""

    @pytest.fixture
    def window(self, control):
        return Window(control)

    def test_sliders(self, window):
        before = pixels(window.control.picture)
        window.incident_slider.GetRepresentation().SetValue(60.0)
        window.incident_slider.InvokeEvent("InteractionEvent")
        assert window.control.theta_i == 60.0
        window.wavelength_slider.GetRepresentation().SetValue(640.0)
        window.wavelength_slider.InvokeEvent("InteractionEvent")
        assert window.control.wavelength == 650.0
        assert window.wavelength_slider.GetRepresentation().GetTitleText() == "λ = 650 nm"
        assert window.incident_slider.GetRepresentation().GetTitleText() == "θi = 60°"
        assert np.abs(pixels(window.control.picture).astype(int) - before).max() > 100

    def test_keys(self, window):
        for key, radius in (("l", "cosine"), ("l", "linear")):
            window.interactor.SetKeySym(key)
            window.interactor.InvokeEvent("KeyPressEvent")
            assert window.control.picture.look.radius == radius
        for key in window.keys:
            assert f"{key} " in KEYS

    def test_a_click_is_told_from_a_drag(self, window):
        panel = window.control.picture.panels[0]
        x, y = (int(v) for v in project(panel.renderer, panel.marks[0].positions)[9])
        window.interactor.SetEventInformation(x, y)
        window.interactor.InvokeEvent("LeftButtonPressEvent")
        window.interactor.InvokeEvent("LeftButtonReleaseEvent")
        assert "measured" in window.control.message
        window.control.say("")
        window.interactor.InvokeEvent("LeftButtonPressEvent")
        window.interactor.SetEventInformation(x + 30, y)
        window.interactor.InvokeEvent("LeftButtonReleaseEvent")
        assert window.control.message == ""

    def test_controls_are_drawn_inside_the_window(self, window):
        picture = pixels(window.control.picture)
        assert picture[-60:].min() < 200
        for edge in (picture[:2], picture[-2:], picture[:, :2], picture[:, -2:]):
            assert edge.min() == 255

"""Pictures, pixel by pixel, against projections worked out by hand."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from clbrdf import Directions, InputError, Scan
from clbrdf.models import get_model
from clbrdf.viz.camera import project
from clbrdf.viz.layout import panel_places
from clbrdf.viz.lobes import CUT_OFF
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.picture import Picture
from clbrdf.viz.stills import pixels
from clbrdf.viz.style import LobeStyle, rgb
from clbrdf.viz.subject import Subject
from tests.planted import with_parameters
from tests.viz.conftest import all_masked, fit_by_hand, fit_of

pytestmark = pytest.mark.usefixtures("gl")

SIZE = (600, 450)
BARE = LobeStyle(points=False)


@pytest.fixture
def picture(request):
    """A maker of scenes that are closed after the test."""
    made = []

    def make(requests, look=BARE, **options):
        made.append(Picture(requests, look, **{"size": SIZE, **options}))
        return made[-1]

    yield make
    for one in made:
        one.close()


def hand_projection(points, picture, panel=0):
    """Pixels (column from the left, row from the top) of world points by the camera's mathematics."""
    a, e = np.deg2rad(picture.view.azimuth), np.deg2rad(picture.view.elevation)
    right = np.array([np.cos(a), np.sin(a), 0.0])
    up = np.array([-np.sin(e) * np.sin(a), np.sin(e) * np.cos(a), np.cos(e)])
    left, bottom, right_edge, top = picture.panels[panel].renderer.viewport
    width, height = picture.size
    middle = np.array([(left + right_edge) / 2 * width, (1 - (bottom + top) / 2) * height])
    per_unit = (top - bottom) * height / 2 / picture.panels[panel].renderer.camera.parallel_scale
    away = np.atleast_2d(points) - picture.view.centre
    return middle + per_unit * np.column_stack([away @ right, -(away @ up)])


def lobe_pixels(picture, panel=0):
    """Pixels that the lobe of a panel owns, (K, 2): those that change when it is hidden."""
    shown = pixels(picture).astype(int)
    actors = picture.panels[panel].actors + picture.panels[panel].outlines
    for actor in actors:
        actor.SetVisibility(False)
    hidden = pixels(picture).astype(int)
    for actor in actors:
        actor.SetVisibility(True)
    return np.argwhere(np.abs(shown - hidden).max(axis=2) > 24)[:, ::-1]


def tip_of(picture, theta_i, panel=0):
    """The lobe's farthest pixel along the mirror direction as projected."""
    mirror = np.array([np.sin(np.deg2rad(theta_i)), 0.0, np.cos(np.deg2rad(theta_i))])
    foot, head = hand_projection([np.zeros(3), mirror], picture, panel)
    along = (head - foot) / np.linalg.norm(head - foot)
    owned = lobe_pixels(picture, panel) + 0.5
    return owned[((owned - foot) @ along).argmax()], head


@pytest.mark.parametrize("theta_i", [30.0, 45.0, 60.0])
@pytest.mark.parametrize("radius", ["linear", "log"])
def test_the_tip_lies_where_the_mathematics_says(picture, foil, theta_i, radius):
    one = picture([LobeRequest(foil, 550.0, theta_i)], replace(BARE, radius=radius))
    tip, expected = tip_of(one, theta_i)
    np.testing.assert_allclose(tip, expected, atol=2.0)


def test_a_needle_of_a_tenth_of_a_degree_is_kept(picture, needle):
    one = picture([LobeRequest(needle, 550.0, 45.0)])
    tip, expected = tip_of(one, 45.0)
    np.testing.assert_allclose(tip, expected, atol=2.0)
    # All along its length, though it is thinner than a pixel.
    owned = lobe_pixels(one)
    foot = hand_projection(np.zeros(3), one)[0]
    reached = np.linalg.norm(owned - foot, axis=1)
    assert np.histogram(reached, 12, (0.0, np.linalg.norm(expected - foot)))[0].min() > 0


def test_the_hand_projection_and_the_one_for_clicks_agree(picture, foil):
    one = picture([LobeRequest(foil, 550.0, 45.0)])
    one.render()
    points = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.9], [-1.0, 0.4, 0.0]])
    found = project(one.panels[0].renderer, points)
    found[:, 1] = SIZE[1] - found[:, 1]
    np.testing.assert_allclose(found, hand_projection(points, one), atol=1.5)


def test_panels_share_one_scale(picture, foil):
    one = picture([LobeRequest(foil, 550.0, a) for a in (30.0, 60.0)], size=(900, 600))
    peak = {30.0: 350.8, 60.0: 1996.7}  # (9) to (12) at the mirror direction, with Table 1
    assert one.scale.top == pytest.approx(peak[60.0], rel=2e-3)
    tip, full = tip_of(one, 30.0, 0)
    foot = hand_projection(np.zeros(3), one)[0]
    share = np.linalg.norm(tip - foot) / np.linalg.norm(full - foot)
    assert share == pytest.approx(peak[30.0] / peak[60.0], abs=0.02)


def test_a_moved_slider_changes_the_right_pixels(picture, foil):
    one = picture([LobeRequest(foil, 550.0, 30.0)], LobeStyle(points=False, radius="log"), words=False)
    before, first = pixels(one).astype(int), {tuple(p) for p in lobe_pixels(one)}
    one.set(theta_i=60.0)
    after, second = pixels(one).astype(int), {tuple(p) for p in lobe_pixels(one)}
    changed = np.abs(before - after).max(axis=2) > 24
    old_tip, new_tip = (
        hand_projection([np.sin(t), 0.0, np.cos(t)], one)[0].astype(int) for t in np.deg2rad([30.0, 60.0])
    )
    near = [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (-2, 2), (2, 2)]
    for x, y in (old_tip, new_tip):
        assert any(changed[y + dy, x + dx] for dx, dy in near)
    # Nothing but lobe, arrows and their labels: the ground disc in front stays.
    foot = hand_projection([0.0, -0.6, 0.0], one)[0].astype(int)
    assert not changed[foot[1] - 10 : foot[1] + 10, foot[0] - 40 : foot[0] + 40].any()
    assert len(first ^ second) > 1000
    one.set(theta_i=30.0)
    np.testing.assert_array_equal(pixels(one), before)


def test_a_wavelength_changes_length_when_the_scale_is_held(picture, foil):
    one = picture([LobeRequest(foil, 650.0, 45.0)])
    one.held = one.scale
    one.set(wavelength=450.0)
    tip, full = tip_of(one, 45.0)
    foot = hand_projection(np.zeros(3), one)[0]
    share = np.linalg.norm(tip - foot) / np.linalg.norm(full - foot)
    assert share == pytest.approx(0.9 / 1.1, abs=0.02)
    assert "(scale held)" in one.notes()[0]


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("size", [(1200, 900), (500, 700)])
def test_nothing_is_cut_off(picture, foil, count, size):
    angles = (10.0, 30.0, 60.0, 84.0)[:count]
    one = picture([LobeRequest(foil, 550.0, a) for a in angles], LobeStyle(), size=size)
    picture = pixels(one)
    assert picture.shape == (size[1], size[0], 3)
    for edge in (picture[:3], picture[-3:], picture[:, :2], picture[:, -2:]):
        assert edge.min() == 255
    if size == (1200, 900):
        # Letters of at least ten pixels; a stroke of text has dark pixels.
        assert one.letter >= 14


def test_overlay_colours_and_difference(picture, foil, small_scan):
    requests = [LobeRequest(foil, 550.0, a) for a in (30.0, 60.0)]
    both = picture(requests, replace(BARE, radius="log"), overlay=True)
    assert len(both.panels) == 1
    tip_30, _ = tip_of(both, 30.0)
    assert len(lobe_pixels(both)) > 2000
    assert tip_30 is not None
    higher = Subject("higher", small_scan, fit_of(small_scan, dict(foil.fit.parameters, kd=9.0)))
    signed = picture([LobeRequest(higher, 550.0, 45.0, foil)])
    assert signed.paint.signed
    assert "higher − foil" in signed.panels[0].requests[0].name
    assert signed.panels[0].caption().splitlines()[1].startswith("largest difference 2.4")


def test_spectral_colour(picture, foil):
    yellow = dict(foil.fit.parameters)
    wide = Scan(
        foil.scan.theta_i,
        0.0,
        foil.scan.theta_r,
        180.0,
        [430.0, 480.0, 530.0, 580.0, 630.0, 680.0],
        np.ones((48, 6)),
    )
    gain = np.array([0.1, 0.3, 0.9, 1.0, 1.0, 1.0])
    parameters = {n: v[1] for n, v in yellow.items()}
    fit = fit_of(wide, {**parameters, "ks": parameters["ks"] * gain, "kd": parameters["kd"] * gain})
    one = picture(
        [LobeRequest(Subject("brass", wide, fit), 580.0, 45.0)],
        replace(BARE, radius="log", colour="spectrum"),
    )
    owned = lobe_pixels(one)
    red, green, blue = pixels(one)[owned[:, 1], owned[:, 0]].mean(axis=0)
    assert red > green > blue + 30
    with pytest.raises(InputError, match="colour by value instead"):
        picture([LobeRequest(foil, 550.0, 45.0)], LobeStyle(colour="spectrum"))


def test_transparent_background(picture, foil):
    one = picture([LobeRequest(foil, 550.0, 45.0)])
    clear = pixels(one, transparent=True)
    assert clear.shape == (450, 600, 4)
    assert clear[-1, 0, 3] == 0
    owned = lobe_pixels(one)
    assert np.median(clear[owned[:, 1], owned[:, 0], 3]) == 255
    assert pixels(one).min(axis=(0, 1)).max() < 255


def test_sensible_pictures_of_poor_data(picture, foil, small_scan):
    masked = picture([LobeRequest(Subject("masked", all_masked(small_scan, 1)), 550.0, 45.0)], LobeStyle())
    assert "nothing fitted or measured here" in masked.panels[0].caption()
    assert pixels(masked).min() < 100  # ground and words are there
    lone = Subject("one", Scan([45.0], 0.0, [45.0], 180.0, [550.0], [[0.5]]))
    one = picture([LobeRequest(lone, 550.0, 45.0)], LobeStyle())
    assert "1 measured point" in one.panels[0].caption()
    assert len(lobe_pixels(one)) > 50


def test_infinite_values_at_grazing_are_cut_and_named(picture, small_scan):
    steep = fit_of(small_scan, {"a": 20.0, "b": -1.0, "c": -1e-9, "d": 0.2, "ks": 1e38, "kd": 1.0})
    one = picture([LobeRequest(Subject("steep", small_scan, steep), 550.0, 45.0)], LobeStyle(radius="log"))
    assert "infinite values cut" in "\n".join(one.notes())
    points = np.asarray(one.panels[0].lobes[0].polydata.points)
    assert np.isfinite(points).all()
    # Beyond 75°, where nothing is measured, the model may be longer than the scale, and ends there.
    assert np.linalg.norm(points, axis=1).max() <= CUT_OFF + 1e-6
    assert "grey beyond 75°, where nothing is measured" in "\n".join(one.notes())


def test_what_is_measured_makes_the_scale(picture, hemisphere):
    """A model that grows beyond the largest measured zenith, 60°, makes neither scale nor colours there."""
    model = get_model("minnaert")
    scan = hemisphere.rows(hemisphere.theta_r <= 60.0)
    fit = with_parameters(fit_by_hand(scan, model), {"rho": [0.9], "k": [0.2]})
    one = picture([LobeRequest(Subject("growing", scan, fit), 650.0, 40.0)], LobeStyle())
    reached = fit.model.brdf(fit.vector, model.features(Directions.relative(40.0, 61.0, 0.0))).max()
    edge = fit.model.brdf(fit.vector, model.features(Directions.relative(40.0, one.limit, 0.0))).max()
    top = max(reached, scan.brdf.max())
    assert edge > 1.5 * top
    assert one.scale.top == pytest.approx(top, rel=0.02)
    assert one.paint.high == pytest.approx(top, rel=0.02)
    lobe = one.panels[0].lobes[0]
    colours = np.asarray(lobe.polydata.point_data["colour"]).astype(int)
    grey = np.ptp(colours, axis=1) < 80
    assert grey.reshape(lobe.mesh.rings + 1, -1)[-1].all()


def test_holding_the_scale_holds_the_colours(picture, foil):
    one = picture([LobeRequest(foil, 550.0, 45.0)], LobeStyle(radius="log", points=True))
    before = pixels(one)
    one.hold()
    words = slice(0, 60)  # where "scale held" is said
    np.testing.assert_array_equal(pixels(one)[words.stop :], before[words.stop :])
    one.set(theta_i=60.0)
    held = one.paint
    assert held.high == one.held_paint.high
    one.release()
    assert one.paint.high > 2.0 * held.high


def test_overlays_keep_their_colours_and_points(picture, foil):
    requests = [LobeRequest(foil, 550.0, a) for a in (30.0, 45.0, 60.0)]
    one = picture(requests, LobeStyle(radius="log", points=True), overlay=True)
    assert [len(m.rows) for m in one.panels[0].marks] == [16, 16, 16]
    for actor in one.panels[0].actors:
        assert actor.GetProperty().GetOpacity() == 1.0
    drawn = pixels(one).reshape(-1, 3).astype(int)
    for k in range(3):
        own = 255.0 * np.array(rgb(one.panels[0].colour_of(k)))
        assert (np.abs(drawn - own).max(axis=1) <= 12).sum() > 100


def test_many_points_do_not_hide_the_lobe(picture):
    rng = np.random.default_rng(0)
    theta_r, phi = np.rad2deg(np.arccos(rng.uniform(0.1, 1.0, 25_000))), rng.uniform(0.0, 360.0, 25_000)
    scan = Scan(30.0, 0.0, theta_r, phi, [550.0], np.full((25_000, 1), 0.3))
    one = picture([LobeRequest(Subject("cloud", scan), 550.0, 30.0)], LobeStyle(points=True))
    drawn = pixels(one).astype(int)
    without = [actor for marks in one.panels[0].marks for actor in marks._actors]
    for actor in without:
        actor.SetVisibility(False)
    covered = (np.abs(pixels(one).astype(int) - drawn).max(axis=2) > 60).sum()
    assert covered < 0.35 * len(lobe_pixels(one))
    assert re.search(r"25000 measured points, \d+ of them drawn", one.panels[0].caption())


def test_a_wide_range_keeps_its_floor(picture):
    """Eleven decades, measured: the smallest value has a length and a colour of its own."""
    theta_r = np.arange(0.0, 81.0, 5.0)
    values = 10.0 ** np.linspace(5.0, -6.0, len(theta_r))
    scan = Scan(30.0, 0.0, theta_r, 180.0, [550.0], values[:, None])
    one = picture([LobeRequest(Subject("wide", scan), 550.0, 30.0)], LobeStyle(radius="log"))
    assert one.scale.floor < 1e-6
    assert one.paint.low == pytest.approx(1e-6)
    assert (one.scale.length(values, 1.0) > 0.0).all()


def test_a_difference_says_what_it_compares(picture, foil, small_scan):
    """Another wavelength, and five of 16 directions."""
    other = replace(
        small_scan.rows((small_scan.theta_i == 45.0) & (small_scan.theta_r <= 20.0)),
        wavelength=np.array([450.0, 560.0, 650.0]),
        sample="other",
    )
    request = LobeRequest(Subject("foil", small_scan), 550.0, 45.0, Subject("other", other))
    caption = picture([request], LobeStyle()).panels[0].caption()
    assert "λ = 550 nm minus 560 nm" in caption
    assert "5 of 16 directions compared" in caption


def test_the_mesh_reaches_as_far_as_the_data(picture, foil):
    assert picture([LobeRequest(foil, 550.0, 45.0)]).limit == 85.0
    assert picture([LobeRequest(foil, 550.0, 88.0)]).limit == 88.5


def test_mistakes(picture, foil):
    request = LobeRequest(foil, 550.0, 45.0)
    with pytest.raises(InputError, match="10 lobes in one picture; at most 9"):
        picture([request] * 10)
    with pytest.raises(InputError, match="size 20x450"):
        picture([request], size=(20, 450))
    with pytest.raises(InputError, match="no colour is called 'blue'"):
        picture([request], LobeStyle(colour="blue"))


def test_panels_fill_the_area():
    for count in range(1, 10):
        places = panel_places(count, 1000.0, 800.0)
        assert len(set(places)) == count
        for left, bottom, right, top in places:
            assert 0.0 <= left < right <= 1.0 + 1e-12
            assert -1e-12 <= bottom < top <= 1.0

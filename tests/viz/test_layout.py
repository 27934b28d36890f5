"""Words have room: in small windows, with long names, with several panels, and when a window shrinks."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from clbrdf.viz.layout import panel_places
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.picture import Picture
from clbrdf.viz.style import LobeStyle
from clbrdf.viz.window import Window, controlled_picture

pytestmark = pytest.mark.usefixtures("gl")

LONG = "a very long sample name that somebody typed into the field, batch 2024-11-17 #3, polished twice"
LOG = LobeStyle(radius="log")


def boxes(picture):
    """Left, bottom, right, top, pixels, of everything that is written on the screen."""
    width, height = picture.size
    out = {}
    for text in picture.words.texts:
        words = text.GetInput()
        if not words:
            continue
        size = [0.0, 0.0]
        text.GetSize(picture.words.renderer, size)
        x, top = np.array(text.GetPosition()[:2]) * [width, height]
        anchor = text.GetTextProperty().GetJustification()  # 0 left, 1 centre, 2 right
        left = x - 0.5 * anchor * size[0]
        out[words] = (left, top - size[1], left + size[0], top)
    return out


def overlapping(picture, slack=1.0):
    """Pairs of texts that lie on each other by more than some pixels."""
    return [
        (a, b)
        for (a, p), (b, q) in combinations(boxes(picture).items(), 2)
        if min(p[2], q[2]) - max(p[0], q[0]) > slack and min(p[3], q[3]) - max(p[1], q[1]) > slack
    ]


@pytest.mark.parametrize("size", [(200, 200), (260, 200), (400, 300), (1200, 900), (1600, 500)])
@pytest.mark.parametrize("name", ["foil", LONG])
def test_no_words_lie_on_others(foil, size, name):
    named = replace(foil, name=name)
    for requests, overlay in (
        ([LobeRequest(named, 550.0, 45.0)], False),
        ([LobeRequest(named, 550.0, 45.0), LobeRequest(replace(foil, name=f"{name}, B"), 650.0, 60.0)], True),
        ([LobeRequest(named, 550.0, a) for a in (0.0, 30.0, 45.0, 60.0)], False),
    ):
        picture = Picture(requests, LOG, size=size, overlay=overlay)
        picture.render()
        assert overlapping(picture) == []
        for words, (left, bottom, right, top) in boxes(picture).items():
            assert left >= 0.0, words
            assert bottom >= 0.0, words
            assert right <= size[0] + 1.0, words
            assert top <= size[1], words
        picture.close()


def test_a_window_that_shrinks_is_laid_out_anew(foil):
    control = controlled_picture([LobeRequest(foil, 550.0, 45.0)], LOG, (1200, 900), off_screen=True)
    window = Window(control)
    control.picture.render()
    control.picture.plotter.render_window.SetSize(420, 320)
    control.picture.render()
    assert control.picture.size == (420, 320)
    assert control.picture.letter == 10
    assert overlapping(control.picture) == []
    assert window.control is control
    control.picture.close()


def test_two_panels_stand_side_by_side():
    """One above the other, with a caption each, lobes would be smaller, and half of the width blank."""
    places = panel_places(2, 1068.0, 750.0, caption=76.0)
    assert [p[2] - p[0] for p in places] == [0.5, 0.5]


def labels(picture):
    """Boxes, pixels, of the labels in the first panel that are to be seen."""
    from clbrdf.viz.camera import project

    panel = picture.panels[0]
    out = {}
    for k, actor in enumerate(panel.ground.letters.actors):
        if not actor.GetVisibility():
            continue
        shape = actor.GetTextProperty()
        x, y = project(panel.renderer, actor.GetPosition())[0]
        text, letter = actor.GetInput(), shape.GetFontSize()
        wide, high = 0.58 * letter * len(text), 0.75 * letter
        left = x - 0.5 * shape.GetJustification() * wide
        low = y - 0.5 * shape.GetVerticalJustification() * high  # 0 bottom, 1 centre, 2 top
        out[f"{k} {text}"] = (left, low, left + wide, low + high)
    return out


@pytest.mark.parametrize("theta_i", [0.0, 5.0, 20.0, 45.0, 60.0, 70.0, 80.0, 85.0])
def test_no_label_lies_on_another(foil, theta_i):
    for size in ((400, 300), (700, 525), (1200, 900)):
        picture = Picture([LobeRequest(foil, 550.0, theta_i)], LOG, size=size)
        picture.render()
        for (a, p), (b, q) in combinations(labels(picture).items(), 2):
            across, along = min(p[2], q[2]) - max(p[0], q[0]), min(p[3], q[3]) - max(p[1], q[1])
            assert min(across, along) <= 1.0, (size, a, b)
        picture.close()

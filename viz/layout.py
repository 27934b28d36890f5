"""Where everything stands in a picture of a size: words above, panels below them, the key beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from clbrdf.viz.camera import HALF_HEIGHT, HALF_WIDTH

Place = tuple[float, float, float, float]
"""Left, bottom, right, top, normalised."""

Corner = tuple[float, float, float, int]
"""Left, top and right end of a caption, normalised in the window, and the height of its letters."""

LEFT_EDGE, TOP_EDGE = 0.018, 0.985
TITLE_SIZE = 1.2
LINE_HEIGHT = 1.17
LETTER_WIDTH = 0.57
"""Of DejaVu Sans, in letters' heights: a line, and a letter of usual text."""

SMALLEST_LETTER = 9
KEY_LETTERS = 9.0
"""Room for the key: the bar and "– 0.0123"."""
KEY_SHARE = 0.11
"""The key's share of the width where that is more."""
MOST_WORDS = 0.42
"""Share of the height that title and notes may take; beyond it the notes are left out."""
MOST_CAPTION = 0.4
"""Share of a panel's height that its caption may take; beyond it one line is left."""
LARGEST_LABEL, READABLE_LABEL = 0.07, 0.0765
"""Of a panel's labels, over the length of its lobe: the largest height, and the largest that has room."""


@dataclass(frozen=True)
class PanelPlace:
    """One panel: viewport, the same in pixels, height of labels, caption, and whether labels have room."""

    viewport: Place
    pixels: tuple[int, int]
    letter: int
    corner: Corner
    caption_lines: int
    labelled: bool


@dataclass(frozen=True)
class PictureLayout:
    """A whole picture.

    Attributes
    ----------
    size : (int, int)
        Width and height, pixels.
    letter : int
        Height of letters, pixels.
    area : Place
        Of the panels with their captions.
    key_left : float
        Where the key begins.
    notes : bool
        Whether there is room for them.
    panels : tuple of PanelPlace
    """

    size: tuple[int, int]
    letter: int
    area: Place
    key_left: float
    notes: bool
    panels: tuple[PanelPlace, ...]


def characters(width: float, letter: int) -> int:
    """How many letters of a height fit into a width, both in pixels."""
    return max(8, int(0.96 * width / (LETTER_WIDTH * letter)))


def lines_of(texts: Sequence[str], fitting: int) -> int:
    """Lines that texts take where so many letters fit into one."""
    return sum(-(-max(1, len(line)) // fitting) for text in texts for line in text.split("\n"))


def panel_places(count: int, width: float, height: float, caption: float = 0.0) -> list[Place]:
    """Return (left, bottom, right, top) in [0, 1] of `count` panels in an area, with the largest lobes.

    `caption` is the height that each panel's words take, in the unit of the area.
    """

    def lobe_size(columns: int) -> float:
        rows = math.ceil(count / columns)
        return min(width / columns / HALF_WIDTH, (height / rows - caption) / HALF_HEIGHT)

    columns = max(range(1, count + 1), key=lobe_size)
    rows = math.ceil(count / columns)
    return [
        (c / columns, 1.0 - (r + 1) / rows, (c + 1) / columns, 1.0 - r / rows)
        for r, c in (divmod(k, columns) for k in range(count))
    ]


def letter_of(size: tuple[int, int], count: int) -> int:
    """Height of letters, pixels, in a picture of a size with so many panels."""
    return max(10, round(min(size[1], 0.8 * size[0]) / 50 * (1.0 if count < 5 else 0.8)))


def label_of(pixels: tuple[int, int], letter: int) -> tuple[int, bool]:
    """Height of a panel's labels, pixels, and whether all of them have room."""
    lobe = min(pixels[0] / (2.0 * HALF_WIDTH), pixels[1] / (2.0 * HALF_HEIGHT))
    label = max(SMALLEST_LETTER, min(letter, round(LARGEST_LABEL * lobe)))
    return label, label <= READABLE_LABEL * lobe


def arranged(
    size: tuple[int, int],
    captions: Sequence[str],
    notes: Sequence[str],
    area: Place,
    caption_share: float = 1.0,
) -> PictureLayout:
    """Return the layout of a picture with words.

    Parameters
    ----------
    size : (int, int)
        Width and height, pixels.
    captions : sequence of str
        One a panel.
    notes : sequence of str
        Lines under the title.
    area : Place
        Outermost edges of panels and captions; words and key make it smaller.
    caption_share : float
        Share of a panel's width that its caption may take.
    """
    width, height = size
    letter = letter_of(size, len(captions))
    key = max(KEY_SHARE, KEY_LETTERS * LETTER_WIDTH * letter / width)
    note_lines = lines_of(notes, characters(width, letter)) if notes else 0
    words = (2.6 + LINE_HEIGHT * note_lines) * letter / height
    with_notes = bool(notes) and words <= MOST_WORDS
    if not with_notes:
        words = 2.2 * letter / height
    left, bottom, right, top = area[0], area[1], min(area[2], 1.0 - key), min(area[3], 1.0 - words)
    across, high = (right - left) * width, (top - bottom) * height
    usual = (3 * LINE_HEIGHT + 0.7) * letter
    panels = []
    for place, caption in zip(panel_places(len(captions), across, high, usual), captions, strict=True):
        x0, x1 = (left + x * (right - left) for x in place[::2])
        y0, y1 = (bottom + y * (top - bottom) for y in place[1::2])
        wide, tall = (x1 - x0) * width, (y1 - y0) * height
        small = max(SMALLEST_LETTER, round(letter * min(1.0, max(0.7, wide / 600.0))))
        fitting = characters(caption_share * wide, small)
        lines = lines_of([caption], fitting)
        if (LINE_HEIGHT * lines + 0.7) * small > MOST_CAPTION * tall:
            lines = 1
        taken = (LINE_HEIGHT * lines + 0.7) * small
        pixels = round(wide), max(8, round(tall - taken))
        label, labelled = label_of(pixels, letter)
        panels.append(
            PanelPlace(
                viewport=(x0, y0, x1, y1 - taken / height),
                pixels=pixels,
                letter=label,
                corner=(x0 + LEFT_EDGE, y1, x0 + caption_share * (x1 - x0), small),
                caption_lines=lines,
                labelled=labelled,
            )
        )
    return PictureLayout(size, letter, (left, bottom, right, top), 1.0 - key, with_notes, tuple(panels))


def bare(size: tuple[int, int], count: int) -> PictureLayout:
    """Return the layout of a picture without words: panels fill it."""
    letter = letter_of(size, count)
    panels = []
    for x0, y0, x1, y1 in panel_places(count, *size):
        wide, tall = round((x1 - x0) * size[0]), round((y1 - y0) * size[1])
        label, labelled = label_of((wide, tall), letter)
        corner = (x0 + LEFT_EDGE, y1, x1, letter)
        panels.append(PanelPlace((x0, y0, x1, y1), (wide, tall), label, corner, 0, labelled))
    return PictureLayout(size, letter, (0.0, 0.0, 1.0, 1.0), 1.0, False, tuple(panels))

"""Title, notes, captions, key and foot line of a figure, in one renderer over the whole window."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from clbrdf.viz.colour_bar import Key
from clbrdf.viz.lettering import screen_text

LEFT_EDGE, TOP_EDGE = 0.018, 0.985
TITLE_SIZE = 1.2
LINE_HEIGHT = 1.17
"""Of DejaVu Sans, in letters."""

Corner = tuple[float, float, float, int]
"""Left, top and right end of a caption, normalised in the window, and the height of its letters."""


def characters(width: float, letter: int) -> int:
    """How many letters of a height fit into a width, both in pixels: DejaVu Sans averages 0.56."""
    return max(12, int(0.96 * width / (0.57 * letter)))


def wrapped(text: str, width: int) -> str:
    """Break lines longer than a number of letters."""
    return "\n".join(textwrap.fill(line, width) for line in text.split("\n"))


def words_height(size: tuple[int, int], letter: int, lengths: Sequence[int]) -> float:
    """Part of a window that the title and notes of some lengths (letters a line) take."""
    lines = sum(-(-length // characters(size[0], letter)) for length in lengths)
    return (2.6 + LINE_HEIGHT * lines) * letter / size[1]


class Words:
    """What a figure says.

    Parameters
    ----------
    window : vtkRenderWindow
        With a layer 2.
    size : (int, int)
        Width and height, pixels.
    letter : int
        Height of letters, pixels.
    corners : sequence of Corner
        Where the captions of the panels stand.
    """

    def __init__(self, window: Any, size: tuple[int, int], letter: int, corners: Sequence[Corner]) -> None:
        from vtkmodules.vtkRenderingCore import vtkRenderer

        self.size, self.letter, self.corners = size, letter, list(corners)
        self.renderer = vtkRenderer()
        self.renderer.SetLayer(2)
        self.renderer.InteractiveOff()
        window.AddRenderer(self.renderer)
        self.key = Key(self.renderer, letter)
        below_title = TOP_EDGE - 1.75 * letter / size[1]
        self._title = self._text((LEFT_EDGE, TOP_EDGE), round(TITLE_SIZE * letter), bold=True)
        self._notes = self._text((LEFT_EDGE, below_title), letter)
        self._foot = self._text((LEFT_EDGE, 2.0 * letter / size[1]), letter)
        self._captions = [self._text((x, y), small) for x, y, _, small in corners]

    def _text(self, place: tuple[float, float], size: int, bold: bool = False) -> Any:
        return screen_text(self.renderer, "", place, size, bold=bold)

    def show(self, title: str, notes: Sequence[str], captions: Sequence[str]) -> None:
        """Set everything but the key and the foot line; long lines are broken, a long title is cut."""
        fitting = characters(self.size[0], self.letter)
        self._title.SetInput(textwrap.shorten(title, round(fitting / TITLE_SIZE / 1.1), placeholder=" …"))
        self._notes.SetInput(wrapped("\n".join(notes), fitting))
        for actor, text, (left, _, right, letter) in zip(self._captions, captions, self.corners, strict=True):
            actor.SetInput(wrapped(text, characters((right - left) * self.size[0], letter)))

    def say(self, text: str) -> None:
        """Put a line at the foot of the picture."""
        self._foot.SetInput(wrapped(text, characters(self.size[0], self.letter)))

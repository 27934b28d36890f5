"""Title, notes, captions, key and foot line of a figure, in one renderer over the whole window."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from clbrdf.viz.colour_bar import Key
from clbrdf.viz.layout import LEFT_EDGE, TITLE_SIZE, TOP_EDGE, PictureLayout, characters
from clbrdf.viz.lettering import screen_text


def wrapped(text: str, width: int) -> str:
    """Break lines longer than a number of letters."""
    return "\n".join(textwrap.fill(line, width) for line in text.split("\n"))


class Words:
    """What a figure says.

    Parameters
    ----------
    window : vtkRenderWindow
        With a layer 2.
    layout : PictureLayout
    """

    def __init__(self, window: Any, layout: PictureLayout) -> None:
        from vtkmodules.vtkRenderingCore import vtkRenderer

        self.renderer = vtkRenderer()
        self.renderer.SetLayer(2)
        self.renderer.InteractiveOff()
        window.AddRenderer(self.renderer)
        self.key = Key(self.renderer, layout)
        self._title, self._notes, self._foot = self._text(bold=True), self._text(), self._text()
        self._captions = [self._text() for _ in layout.panels]
        self.layout = layout
        self.arrange(layout)

    @property
    def texts(self) -> list[Any]:
        """Everything that is written here and in the key."""
        return [self._title, self._notes, self._foot, *self._captions, *self.key.texts]

    def arrange(self, layout: PictureLayout) -> None:
        """Put everything where a layout has it."""
        self.layout = layout
        letter, height = layout.letter, layout.size[1]
        below_title = TOP_EDGE - 1.75 * letter / height
        places = [
            (self._title, LEFT_EDGE, TOP_EDGE, round(TITLE_SIZE * letter)),
            (self._notes, LEFT_EDGE, below_title, letter),
            (self._foot, LEFT_EDGE, (0.5 + 1.3 * self._foot_lines) * letter / height, letter),
            *(
                (a, p.corner[0], p.corner[1], p.corner[3])
                for a, p in zip(self._captions, layout.panels, strict=True)
            ),
        ]
        for actor, x, y, size in places:
            actor.SetPosition(x, y)
            actor.GetTextProperty().SetFontSize(size)
        self.key.arrange(layout)

    @property
    def _foot_lines(self) -> int:
        return 1 + (self._foot.GetInput() or "").count("\n")

    def _text(self, bold: bool = False) -> Any:
        return screen_text(self.renderer, "", (0.0, 0.0), 10, bold=bold)

    def show(self, title: str, notes: Sequence[str], captions: Sequence[str]) -> None:
        """Set everything but the key and the foot line; long lines are broken, a long title is cut."""
        layout = self.layout
        fitting = characters(layout.size[0], layout.letter)
        self._title.SetInput(cut_text(title, round(fitting / TITLE_SIZE / 1.1)))
        self._notes.SetInput(wrapped("\n".join(notes), fitting) if layout.notes else "")
        for actor, text, panel in zip(self._captions, captions, layout.panels, strict=True):
            left, _, right, letter = panel.corner
            room = characters((right - left) * layout.size[0], letter)
            lines = wrapped(text, room).split("\n")
            if len(lines) > panel.caption_lines:
                lines = [
                    *lines[: panel.caption_lines - 1],
                    cut_text(" ".join(lines[panel.caption_lines - 1 :]), room),
                ]
            actor.SetInput("\n".join(lines))

    def say(self, text: str) -> None:
        """Put a line at the foot of the picture."""
        self._foot.SetInput(wrapped(text, characters(self.layout.size[0], self.layout.letter)))
        self.arrange(self.layout)


def cut_text(text: str, room: int) -> str:
    """Cut a text after a number of letters, at a word's end where there is one."""
    if len(text) <= room:
        return text
    cut = textwrap.shorten(text, room, placeholder=" …")
    return cut if len(cut) > 0.5 * room else f"{text[: room - 1]}…"

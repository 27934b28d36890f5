"""Words in a picture, on the screen in pixels."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.style import rgb

FONT_FROM_FILE = 4
"""VTK_FONT_FILE of vtkTextProperty.h."""


def screen_text(
    renderer: Any, text: str, place: tuple[float, float], size: int, anchor: str = "left", bold: bool = False
) -> Any:
    """Add a line or paragraph at a place in normalised viewport coordinates, top edge there; return it."""
    from vtkmodules.vtkRenderingCore import vtkTextActor

    actor = vtkTextActor()
    actor.SetInput(text)
    shape = actor.GetTextProperty()
    _set_font(shape, size, bold=bold)
    shape.SetVerticalJustificationToTop()
    {"left": shape.SetJustificationToLeft, "right": shape.SetJustificationToRight}.get(
        anchor, shape.SetJustificationToCentered
    )()
    actor.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    actor.SetPosition(*place)
    renderer.AddViewProp(actor)
    return actor


@cache
def font_file(bold: bool = False) -> str:
    """Return the path of DejaVu Sans as matplotlib brings it: VTK's own fonts have no Greek letters."""
    import matplotlib

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return str(Path(matplotlib.get_data_path(), "fonts", "ttf", name))


def _set_font(shape: Any, size: int, colour: str = "#111111", bold: bool = False) -> None:
    shape.SetFontFamily(FONT_FROM_FILE)
    shape.SetFontFile(font_file(bold))
    shape.SetFontSize(size)
    shape.SetColor(*rgb(colour))


class Lettering:
    """Adds labels at world positions of one renderer.

    Parameters
    ----------
    renderer : vtkRenderer
    size : int
        Height of the letters, pixels.

    Attributes
    ----------
    actors : list
        All labels.
    """

    def __init__(self, renderer: Any, size: int) -> None:
        self.renderer, self.size = renderer, size
        self.actors: list[Any] = []

    def add(self, text: str, position: npt.ArrayLike, colour: str = "#333333", anchor: str = "centre") -> Any:
        """Add a label at a position; return its actor.

        `anchor` names the part of the label that lies there: "centre", "left" or "right" end, or the middle
        of the lower edge ("below").
        """
        actor = self._screen(text, colour, anchor)
        self.move(actor, position)
        actor.SetPickable(False)
        self.renderer.AddActor(actor)
        self.actors.append(actor)
        return actor

    def resize(self, size: int) -> None:
        """Change the height of all letters, pixels."""
        self.size = size
        for actor in self.actors:
            actor.GetTextProperty().SetFontSize(size)

    def write(self, actor: Any, text: str) -> None:
        """Change the words of a label of `add`."""
        actor.SetInput(text)

    def move(self, actor: Any, position: npt.ArrayLike) -> None:
        """Put a label of `add` elsewhere."""
        actor.SetPosition(*np.asarray(position, dtype=float))

    @staticmethod
    def anchor(actor: Any, anchor: str) -> None:
        """Change which part of a label of `add` lies at its position."""
        shape = actor.GetTextProperty()
        if anchor == "below":
            shape.SetVerticalJustificationToBottom()
        else:
            shape.SetVerticalJustificationToCentered()
        {"left": shape.SetJustificationToLeft, "right": shape.SetJustificationToRight}.get(
            anchor, shape.SetJustificationToCentered
        )()

    def _screen(self, text: str, colour: str, anchor: str) -> Any:
        from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D

        actor = vtkBillboardTextActor3D()
        actor.SetInput(text)
        _set_font(actor.GetTextProperty(), self.size, colour)
        self.anchor(actor, anchor)
        return actor

"""Words in a picture: on the screen in pixels, or as flat shapes for files that turn in a browser.

Exported scenes hold geometry only, so there the labels are letters made of triangles that face the first
camera position.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.style import rgb

FONT_FROM_FILE = 4
"""VTK_FONT_FILE of vtkTextProperty.h."""
LETTER_LENGTH = 0.042
PLAIN_LETTERS = {ord("°"): "", ord("θ"): "theta ", ord("φ"): "phi", ord("×"): "x", ord("–"): "-"}
"""The outlines that VTK turns into triangles know ASCII only."""
"""Height of flat letters where a lobe has length 1."""


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
    facing : (3, 3) array or None
        Right, up and towards the viewer: labels become flat shapes that face this way. None keeps them on
        the screen.
    """

    def __init__(self, renderer: Any, size: int, facing: npt.NDArray[np.float64] | None = None) -> None:
        self.renderer, self.size, self.facing = renderer, size, facing
        self._anchors: dict[Any, str] = {}

    def add(self, text: str, position: npt.ArrayLike, colour: str = "#333333", anchor: str = "centre") -> Any:
        """Add a label at a position; return its actor.

        `anchor` names the part of the label that lies there: "centre", "left" or "right" end, or the middle
        of the lower edge ("below").
        """
        actor = (
            self._screen(text, colour, anchor) if self.facing is None else self._shape(text, colour, anchor)
        )
        self._anchors[actor] = anchor
        self.move(actor, position)
        actor.SetPickable(False)
        self.renderer.AddActor(actor)
        return actor

    def write(self, actor: Any, text: str) -> None:
        """Change the words of a label of `add`."""
        if self.facing is None:
            actor.SetInput(text)
        else:
            actor.GetMapper().SetInputData(_letters(text, self._anchors[actor]))

    def move(self, actor: Any, position: npt.ArrayLike) -> None:
        """Put a label of `add` elsewhere."""
        where = np.asarray(position, dtype=float)
        if self.facing is None:
            actor.SetPosition(*where)
            return
        turn = actor.GetUserMatrix()
        for row in range(3):
            turn.SetElement(row, 3, float(where[row]))
        actor.Modified()

    def _screen(self, text: str, colour: str, anchor: str) -> Any:
        from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D

        actor = vtkBillboardTextActor3D()
        actor.SetInput(text)
        shape = actor.GetTextProperty()
        _set_font(shape, self.size, colour)
        if anchor == "below":
            shape.SetVerticalJustificationToBottom()
        else:
            shape.SetVerticalJustificationToCentered()
        {"left": shape.SetJustificationToLeft, "right": shape.SetJustificationToRight}.get(
            anchor, shape.SetJustificationToCentered
        )()
        return actor

    def _shape(self, text: str, colour: str, anchor: str) -> Any:
        from vtkmodules.vtkCommonMath import vtkMatrix4x4
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        assert self.facing is not None
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(_letters(text, anchor))
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(*rgb(colour))
        actor.GetProperty().LightingOff()
        turn = vtkMatrix4x4()
        for column, axis in enumerate(self.facing):
            for row in range(3):
                turn.SetElement(row, column, float(axis[row]))
        actor.SetUserMatrix(turn)
        return actor


def _letters(text: str, anchor: str) -> Any:
    """Return a word as triangles, anchored at the origin."""
    import pyvista as pv
    from vtkmodules.vtkRenderingFreeType import vtkVectorText

    letters = vtkVectorText()
    letters.SetText(text.translate(PLAIN_LETTERS))
    letters.Update()
    flat = pv.wrap(letters.GetOutput())
    left, right, low, high, _, _ = flat.bounds
    across = {"left": left, "right": right}.get(anchor, (left + right) / 2.0)
    flat.points -= np.array([across, low if anchor == "below" else (low + high) / 2.0, 0.0])
    flat.points *= LETTER_LENGTH
    return flat

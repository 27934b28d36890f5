"""The key of a picture: which colour means which value, or which surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.layout import PictureLayout
from clbrdf.viz.lettering import screen_text
from clbrdf.viz.radius import fine_steps, tick_text
from clbrdf.viz.style import DIFFERENCE_MAP, VALUE_MAP, colour_table, rgb

Colours = npt.NDArray[np.uint8]

BAR_LETTERS = 1.3
"""Width of the bar, in letters."""
LONGEST, OVERHANG = 0.56, 0.06
"""Of the bar: its largest height, and its distance from the lower end of the panels, normalised."""


@dataclass(frozen=True)
class ValuePaint:
    """Colours of values: logarithmic between `low` and `high`, or linear from −`high` to `high` if signed."""

    low: float
    high: float
    signed: bool = False

    def position(self, values: npt.ArrayLike) -> npt.NDArray[np.floating]:
        """Place of values on the bar, 0 to 1."""
        f = np.asarray(values)
        if self.signed:
            return np.asarray(np.clip(0.5 + 0.5 * f / self.high, 0.0, 1.0))
        low, high, number = self.low, self.high, f.dtype.type
        inside = np.fmin(np.fmax(f, number(low)), number(high))
        return np.asarray(np.log(inside * number(1.0 / low)) * number(1.0 / np.log(high / low)))

    def __call__(self, values: npt.NDArray[np.floating]) -> Colours:
        """Colours (..., 3) of values (...) in 1/sr."""
        table = colour_table(DIFFERENCE_MAP if self.signed else VALUE_MAP)
        places = np.clip(255.0 * self.position(values), 0.0, 255.0).astype(np.uint8)
        return np.asarray(table.take(places, axis=0))

    def ticks(self) -> list[tuple[float, str]]:
        """Places and labels on the bar."""
        if self.signed:
            values = [-self.high, -0.5 * self.high, 0.0, 0.5 * self.high, self.high]
            return [(float(self.position(v)), f"{v:+.3g}" if v else "0") for v in values]
        decades = np.arange(np.ceil(np.log10(self.low)), np.floor(np.log10(self.high)) + 1.0)
        values = [10.0**k for k in decades]
        if len(values) < 3:
            values = fine_steps(self.low, self.high)
        return [(float(self.position(v)), tick_text(float(f"{v:.3g}"))) for v in values]


def value_paint(low: float, high: float, signed: bool) -> ValuePaint:
    """Paint for values from `low` to `high`, 1/sr; a span of at least a factor of two."""
    top = high if high > 0.0 else 1.0
    return ValuePaint(min(low if low > 0.0 else 1e-3 * top, 0.5 * top), top, signed)


class Key:
    """The key in one renderer that covers the window.

    Parameters
    ----------
    renderer : vtkRenderer
    layout : PictureLayout
    """

    def __init__(self, renderer: Any, layout: PictureLayout) -> None:
        self.renderer, self.layout = renderer, layout
        self._shown: list[Any] = []
        self.texts: list[Any] = []
        self._state: object = None

    def arrange(self, layout: PictureLayout) -> None:
        """Stand where a layout has it; what is shown is to be shown anew."""
        if layout != self.layout:
            self.layout, self._state = layout, None

    def _clear(self) -> None:
        for actor in self._shown:
            self.renderer.RemoveViewProp(actor)
        self._shown, self.texts = [], []

    def show_bar(self, paint: ValuePaint, title: str) -> None:
        """Show the bar of a paint."""
        if self._state == (paint, title):
            return
        self._state = (paint, title)
        self._clear()
        layout = self.layout
        letter = layout.letter / layout.size[1]
        left = layout.key_left
        right = left + BAR_LETTERS * layout.letter / layout.size[0]
        head = layout.area[3]
        top = head - (1.7 + 1.2 * title.count("\n")) * letter - 0.5 * letter
        bottom = max(layout.area[1] + OVERHANG, top - LONGEST)
        table = colour_table(DIFFERENCE_MAP if paint.signed else VALUE_MAP)
        self._shown.append(self._quads(left, right, np.linspace(bottom, top, len(table) + 1), table))
        self._text(title, (0.992, head), "right")
        free = top + letter
        for place, label in sorted(paint.ticks(), reverse=True):
            at = bottom + place * (top - bottom)
            if free - at >= 1.2 * letter:  # labels that would touch are left out
                self._text(f"– {label}", (right + 0.001, at + 0.6 * letter), "left")
                free = at

    def show_names(self, names: Sequence[tuple[str, str]], title: str = "", top: float = 0.985) -> None:
        """Show a list of (name, colour "#rrggbb") from a height in the window, normalised, downwards."""
        if self._state == (tuple(names), title, top):
            return
        self._state = (tuple(names), title, top)
        self._clear()
        line = 1.7 * self.layout.letter / self.layout.size[1]
        if title:
            self._text(title, (0.985, top), "right")
            top -= line * (1 + title.count("\n"))
        for k, (name, colour) in enumerate(names):
            upper = top - k * line
            edges = np.array([upper - 0.75 * line, upper - 0.1 * line])
            paint = np.array([[255.0 * c for c in rgb(colour)]], dtype=np.uint8)
            self._shown.append(self._quads(0.962, 0.985, edges, paint))
            self._text(name, (0.955, upper), "right")

    def _text(self, text: str, place: tuple[float, float], anchor: str = "centre") -> None:
        self._shown.append(screen_text(self.renderer, text, place, self.layout.letter, anchor))
        self.texts.append(self._shown[-1])

    def _quads(self, left: float, right: float, heights: npt.NDArray[np.float64], colours: Colours) -> Any:
        import pyvista as pv
        from vtkmodules.vtkRenderingCore import vtkActor2D, vtkCoordinate, vtkPolyDataMapper2D

        rows = len(heights)
        corners = np.zeros((2 * rows, 3))
        corners[:rows, 0], corners[rows:, 0] = left, right
        corners[:rows, 1] = corners[rows:, 1] = heights
        k = np.arange(rows - 1)
        faces = np.stack([np.full(rows - 1, 4), k, k + rows, k + rows + 1, k + 1], axis=-1)
        data = pv.PolyData(corners, faces=faces.ravel())
        data.cell_data["colour"] = colours
        data.GetCellData().SetActiveScalars("colour")
        place = vtkCoordinate()
        place.SetCoordinateSystemToNormalizedViewport()
        mapper = vtkPolyDataMapper2D()
        mapper.SetInputData(data)
        mapper.SetTransformCoordinate(place)
        actor = vtkActor2D()
        actor.SetMapper(mapper)
        self.renderer.AddViewProp(actor)
        return actor

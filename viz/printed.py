"""A picture of lobes for print (SVG, PDF): the lobes are pixels; words, key and captions scale."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clbrdf.opencl.device import Device
from clbrdf.viz.curves import save_figure
from clbrdf.viz.panel import LobeRequest, Panel
from clbrdf.viz.picture import Picture
from clbrdf.viz.stills import pixels
from clbrdf.viz.style import DIFFERENCE_MAP, VALUE_MAP, LobeStyle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 100
"""Pixels of --size that make an inch."""
FINER = 2
"""Times as many pixels as --size asks for: print shows them."""


def printed_picture(
    requests: Sequence[LobeRequest],
    look: LobeStyle,
    size: tuple[int, int] = (1200, 900),
    overlay: bool = False,
    device: Device | None = None,
) -> Figure:
    """Draw lobes as `Picture` does; everything but the lobes scales.

    Parameters
    ----------
    requests : sequence of LobeRequest
    look : LobeStyle
    size : (int, int)
        Width and height, 1/100 inch.
    overlay : bool
    device : Device, optional

    Raises
    ------
    InputError
        As `Picture`.
    """
    from matplotlib.figure import Figure

    fine = (min(8000, FINER * size[0]), min(8000, FINER * size[1]))
    picture = Picture(requests, look, size=fine, overlay=overlay, words=False, device=device)
    whole = pixels(picture)
    count = len(picture.panels)
    columns = round(1.0 / (picture.layout.panels[0].viewport[2] - picture.layout.panels[0].viewport[0]))
    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), layout="constrained")
    grid = figure.subplots(-(-count // columns), columns, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    for axes, panel, place in zip(grid.ravel(), picture.panels, picture.layout.panels, strict=False):
        x0, y0, x1, y1 = place.viewport
        height, width = whole.shape[:2]
        axes.imshow(
            whole[round((1 - y1) * height) : round((1 - y0) * height), round(x0 * width) : round(x1 * width)]
        )
        axes.set_title(panel.caption(picture.named), loc="left", fontsize=8)
    figure.suptitle(f"{picture.title}\n" + "\n".join(picture.notes()), fontsize=9, x=0.01, ha="left")
    _key(figure, grid, picture)
    picture.close()
    return figure


def _key(figure: Figure, grid: Any, picture: Picture) -> None:
    """Add what the colours mean."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.patches import Patch

    if picture.overlay:
        requests = [request for panel in picture.panels for request in panel.requests]
        names = [
            Patch(color=Panel.colour_of(k), label=picture.overlay_name(request))
            for k, request in enumerate(requests)
        ]
        figure.legend(handles=names, loc="outside upper right", fontsize=8, frameon=False)
    elif picture.look.colour == "value":
        paint = picture.paint
        norm = Normalize(-paint.high, paint.high) if paint.signed else LogNorm(paint.low, paint.high)
        shades = ScalarMappable(norm, DIFFERENCE_MAP if paint.signed else VALUE_MAP)
        label = picture.key_title.replace("\n", ", " if not paint.signed else " ")
        figure.colorbar(shades, ax=grid, shrink=0.7, label=label)


def save_printed(
    requests: Sequence[LobeRequest],
    look: LobeStyle,
    path: str | Path,
    size: tuple[int, int] = (1200, 900),
    overlay: bool = False,
    device: Device | None = None,
    overwrite: bool = False,
) -> None:
    """Write `printed_picture` to a file whose name ends in .svg or .pdf, whole or not at all."""
    save_figure(printed_picture(requests, look, size, overlay, device), path, overwrite)

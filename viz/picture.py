"""A picture of lobes: panels side by side with one scale, its title, its key, and how it is redrawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from clbrdf.colour import check_spectrum, colour_weights
from clbrdf.errors import InputError
from clbrdf.opencl.device import Device
from clbrdf.viz.camera import HALF_HEIGHT, HALF_WIDTH, View
from clbrdf.viz.colour import chromatic_rgb
from clbrdf.viz.colour_bar import value_paint
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.lobes import FittedLobe
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import clip_text, kind_of
from clbrdf.viz.panel import LobeRequest, Panel
from clbrdf.viz.radius import RADIUS_MODES, RadiusScale, joined, make_scale
from clbrdf.viz.style import COLOUR_MODES, Look
from clbrdf.viz.subject import drawing_limit
from clbrdf.viz.words import LEFT_EDGE, Corner, Words, words_height

Place = tuple[float, float, float, float]
"""Left, bottom, right, top, normalised."""

MOST_PANELS = 9
SMALLEST, LARGEST = 200, 8000
"""Sides of a picture, pixels."""
STILL_SAMPLES, MOVING_SAMPLES = 4, 0
"""Samples a pixel, in files and while sliders move."""
CAPTION_LINES = 4.2
"""Height of a panel's caption, in letters."""
NOTE_LENGTHS = (95, 108)
NOTE_LENGTHS_MIXED = (135, 108)
"""Letters of the longest usual lines of `Picture.notes`; with measured and modelled surfaces."""
WHOLE = (0.0, 0.0, 1.0, 1.0)


def panel_places(count: int, width: float, height: float) -> list[Place]:
    """Return (left, bottom, right, top) in [0, 1] of `count` panels in an area, with the largest lobes."""

    def lobe_size(columns: int) -> float:
        rows = math.ceil(count / columns)
        return min(width / columns / HALF_WIDTH, height / rows / HALF_HEIGHT)

    columns = max(range(1, count + 1), key=lobe_size)
    rows = math.ceil(count / columns)
    return [
        (c / columns, 1.0 - (r + 1) / rows, (c + 1) / columns, 1.0 - r / rows)
        for r, c in (divmod(k, columns) for k in range(count))
    ]


class Picture:
    """Lobes of several requests, drawn.

    Parameters
    ----------
    requests : sequence of LobeRequest
        At most MOST_PANELS, unless laid over each other.
    look : Look
    size : (int, int)
        Width and height, pixels.
    overlay : bool
        All lobes in one panel.
    words : bool
        Title, captions and key on the picture; a page that brings its own words leaves them out.
    off_screen : bool
    area : (float, float, float, float)
        Left, bottom, right, top of the panels in the window; the rest is for words and controls.
    mesh : LobeMesh, optional
        Instead of the one made for each lobe.
    device : Device, optional
    inset : (float, float, float, float), optional
        Left, bottom, right, top of one more renderer, `Picture.inset`, for a chart.
    samples : int
        Samples a pixel against jagged edges; 0 is two to three times faster in software rendering.
    limit : float, optional
        View zenith where meshes end, degrees; by default what data and angles need, at least 85.

    Raises
    ------
    InputError
        Too many panels, a size out of range, spectral colours asked of a scan that has none.
    """

    def __init__(
        self,
        requests: Sequence[LobeRequest],
        look: Look = Look(),  # noqa: B008 (immutable)
        *,
        size: tuple[int, int] = (1200, 900),
        overlay: bool = False,
        words: bool = True,
        off_screen: bool = True,
        area: Place = (0.0, 0.0, 0.89, 0.89),
        mesh: LobeMesh | None = None,
        device: Device | None = None,
        limit: float | None = None,
        inset: Place | None = None,
        samples: int = STILL_SAMPLES,
    ) -> None:
        import pyvista as pv

        if not all(SMALLEST <= side <= LARGEST for side in size):
            raise InputError(f"size {size[0]}x{size[1]}: sides lie between {SMALLEST} and {LARGEST} pixels")
        if len(requests) > MOST_PANELS:
            raise InputError(f"{len(requests)} lobes in one picture; at most {MOST_PANELS} are legible")
        self.look, self.size, self.overlay = look, size, overlay and len(requests) > 1
        self._check(requests, look)
        self.held: RadiusScale | None = None
        self.scale = RadiusScale(look.radius, 1.0, 1e-3)
        self.paint = value_paint(1e-3, 1.0, False)
        self.limit = limit or drawing_limit([e.subject for e in requests], [e.theta_i for e in requests])
        groups = [list(requests)] if self.overlay else [[e] for e in requests]
        self.letter = max(10, round(min(size[1], 0.8 * size[0]) / 50 * (1.0 if len(groups) < 5 else 0.8)))
        mixed = len({e.subject.fit is None for e in requests}) > 1
        height = words_height(size, self.letter, NOTE_LENGTHS_MIXED if mixed else NOTE_LENGTHS)
        self.area = (*area[:3], min(area[3], 1.0 - height)) if words else WHOLE
        left, bottom, right, top = self.area
        places = panel_places(len(groups), (right - left) * size[0], (top - bottom) * size[1])
        self.plotter = pv.Plotter(
            shape=(1, len(groups) + (inset is not None)),
            off_screen=off_screen,
            window_size=list(size),
            border=False,
        )
        self.plotter.render_window.SetMultiSamples(samples)
        self.background: Any = None
        self._lay_background()
        self.view = View()
        self.panels: list[Panel] = []
        self._sizes: list[tuple[int, int]] = []
        self.corners: list[Corner] = []
        self.inset = self.plotter.renderers[len(groups)] if inset is not None else None
        if self.inset is not None and inset is not None:
            self.inset.viewport = inset
        for renderer, group, place in zip(self.plotter.renderers, groups, places, strict=False):
            x0, x1 = (left + x * (right - left) for x in place[::2])
            y0, y1 = (bottom + y * (top - bottom) for y in place[1::2])
            letter = round(self.letter * min(1.0, max(0.75, (x1 - x0) * size[0] / 700.0)))
            caption_height = CAPTION_LINES * letter / size[1] if words else 0.0
            renderer.viewport = (x0, y0, x1, y1 - caption_height)
            small = round((x1 - x0) * size[0]), round((y1 - y0 - caption_height) * size[1])
            letters = Lettering(renderer, letter)
            self.panels.append(Panel(renderer, group, look, self.limit, letters, mesh, device))
            self._sizes.append(small)
            self.view.apply(renderer.camera, *small)
            renderer.camera_set = True
            self.corners.append((x0 + LEFT_EDGE, y1, x1, letter))
        window = self.plotter.render_window
        self.words = Words(window, size, self.letter, self.corners) if words else None
        self.update()

    @staticmethod
    def _check(requests: Sequence[LobeRequest], look: Look) -> None:
        if look.radius not in RADIUS_MODES:
            raise InputError(f"no radius is called {look.radius!r}; there are {', '.join(RADIUS_MODES)}")
        if look.colour not in COLOUR_MODES:
            raise InputError(f"no colour is called {look.colour!r}; there are {', '.join(COLOUR_MODES)}")
        if look.colour == "spectrum":
            for request in requests:
                if request.minus is not None:
                    raise InputError("a difference has no spectral colour; colour it by value")
                check_spectrum(request.subject.wavelength)

    def _lay_background(self) -> None:
        """Put a white renderer under everything: panels do not cover the window."""
        from vtkmodules.vtkRenderingCore import vtkRenderer

        self.background = vtkRenderer()
        self.background.SetBackground(1.0, 1.0, 1.0)
        self.background.InteractiveOff()
        window = self.plotter.render_window
        window.SetNumberOfLayers(3)
        for renderer in self.plotter.renderers:
            renderer.SetLayer(1)
        window.AddRenderer(self.background)

    def update(self) -> None:
        """Evaluate, scale, shape, paint and word everything anew; drawing is left to the caller."""
        values = [pair for panel in self.panels for pair in panel.evaluate()]
        if self.held is None:
            scales = [make_scale(self.look.radius, f, c, self.look.floor) for f, c in values]
            self.scale = joined(scales) if scales else RadiusScale(self.look.radius, 1.0, 1e-3)
        else:
            self.scale = self.held
        signed = self.panels[0].signed
        finite = [f[np.isfinite(f) & (f > 0.0)] for f, _ in values]
        some = [f for f in finite if f.size]
        low = min((float(f.min()) for f in some), default=1e-3)
        high = max((float(f.max()) for f in some), default=1.0)
        if self.held is not None:
            low, high = self.held.floor, self.held.top
        self.paint = value_paint(max(low, self.scale.floor), high, signed)
        by_value = self.look.colour == "value"
        for panel in self.panels:
            panel.draw(self.scale, self.paint if by_value else None)
            if not by_value and not self.overlay:
                self._paint_spectra(panel)
        if self.words is not None:
            self._word(self.words)

    @staticmethod
    def _paint_spectra(panel: Panel) -> None:
        for lobe, there in zip(panel.lobes, panel.there, strict=True):
            if there:
                weights = colour_weights(panel.requests[0].subject.wavelength)
                lobe.set_colours(chromatic_rgb(lobe.spectra() @ weights.T))

    def _word(self, words: Words) -> None:
        words.show(self.title, self.notes(), [panel.caption(self.named) for panel in self.panels])
        if self.overlay:
            requests = [e for p in self.panels for e in p.requests]
            names = [(self.overlay_name(e), Panel.colour_of(k)) for k, e in enumerate(requests)]
            words.key.show_names(names, top=self.area[3])
        elif self.look.colour == "spectrum":
            words.key.show_names([], "colour: hue of the spectrum\nin daylight D65")
        else:
            words.key.show_bar(self.paint, self.key_title)

    @property
    def title(self) -> str:
        """Names of everything shown."""
        return ",  ".join(dict.fromkeys(e.name for p in self.panels for e in p.requests))

    @property
    def named(self) -> bool:
        """Whether panels need the name of what they show."""
        return len({e.name for p in self.panels for e in p.requests}) > 1

    @property
    def key_title(self) -> str:
        """Title of the colour bar."""
        return "difference\n(1/sr)" if self.panels[0].signed else "BRDF (1/sr)\nlog colours"

    def overlay_name(self, request: LobeRequest) -> str:
        """Name of one of several lobes in one panel."""
        return f"{request.name}, θi = {request.theta_i:g}°, {request.subject.label(request.column)}"

    def notes(self) -> list[str]:
        """Return what the figure says of itself: sources of the surfaces, radius, limit, what is cut."""
        lobes = [lobe for p in self.panels for lobe in p.lobes]
        requests = [e for p in self.panels for e in p.requests]
        kinds = dict.fromkeys(
            kind_of(e.subject, isinstance(lobe, FittedLobe)) for e, lobe in zip(requests, lobes, strict=True)
        )
        radius = self.scale.title
        if self.panels[0].signed:
            radius = radius.replace("BRDF", "size of the difference")
        out = [f"surface: {'; '.join(kinds)}.  {radius}" + (" (scale held)" if self.held else "")]
        if any(isinstance(lobe, FittedLobe) for lobe in lobes):
            wild = sum(int(np.count_nonzero(~np.isfinite(lobe.values))) for lobe in lobes)
            out.append(clip_text(self.limit) + (f"; {wild} infinite values cut" if wild else ""))
        if any(p.marks and p.marks[0].model is not None for p in self.panels):
            out[-1] += ".  Whiskers: measured above (orange), below (blue)"
        return out

    def set(self, wavelength: float | None = None, theta_i: float | None = None) -> None:
        """Go to another wavelength (nm) or incident zenith (degrees) in every panel and redraw the shapes."""
        for panel in self.panels:
            panel.set(wavelength, theta_i)
        self.update()

    def restyle(self, **changes: Any) -> None:
        """Change the look: radius, colour or floor.

        Raises
        ------
        InputError
            The scan has no spectral colour.
        """
        look = replace(self.look, **changes)
        self._check([e for p in self.panels for e in p.requests], look)
        self.look = look
        self.held = None
        self.update()

    def render(self) -> None:
        """Draw the window."""
        self.plotter.render_window.Render()

    def say(self, text: str) -> None:
        """Put a line at the foot of the picture."""
        if self.words is not None:
            self.words.say(text)

    def first_view(self) -> None:
        """Put all cameras back to where they began."""
        for panel, size in zip(self.panels, self._sizes, strict=True):
            self.view.apply(panel.renderer.camera, *size)

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()

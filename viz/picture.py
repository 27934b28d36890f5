"""A picture of lobes: panels side by side with one scale, its title, its key, and how it is redrawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from clbrdf.colour import check_spectrum, colour_weights
from clbrdf.errors import InputError
from clbrdf.opencl.device import Device
from clbrdf.viz.camera import View
from clbrdf.viz.colour import chromatic_rgb
from clbrdf.viz.colour_bar import ValuePaint, value_paint
from clbrdf.viz.layout import PictureLayout, Place, arranged, bare, characters
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.lobes import FittedLobe
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import clip_text, kind_of
from clbrdf.viz.panel import LobeRequest, Panel, Spanned
from clbrdf.viz.radius import RADIUS_MODES, RadiusScale, common_scale, make_scale
from clbrdf.viz.style import COLOUR_MODES, LobeStyle
from clbrdf.viz.subject import drawing_limit
from clbrdf.viz.words import Words, cut_text

MOST_PANELS = 9
SMALLEST, LARGEST = 200, 8000
"""Sides of a picture, pixels."""
STILL_SAMPLES, MOVING_SAMPLES = 4, 0
"""Samples a pixel, in files and while sliders move."""


USUAL_CAPTION = "θi, λ\npeak\npoints"
OVERLAY_CAPTION = 0.42
"""Share of the width for the caption where names of lobes stand beside it."""


class Picture:
    """Lobes of several requests, drawn.

    Parameters
    ----------
    requests : sequence of LobeRequest
        At most MOST_PANELS, unless laid over each other.
    look : LobeStyle
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
        look: LobeStyle = LobeStyle(),  # noqa: B008 (immutable)
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
        self.held_paint = value_paint(1e-3, 1.0, False)
        self.scale = RadiusScale(look.radius, 1.0, 1e-3)
        self.paint = value_paint(1e-3, 1.0, False)
        self.limit = limit or drawing_limit([e.subject for e in requests], [e.theta_i for e in requests])
        groups = [list(requests)] if self.overlay else [[e] for e in requests]
        self._edges, self._inset_place, self._worded = area, inset, words
        captions = [USUAL_CAPTION] * len(groups)
        self.layout = arranged(size, captions, (), area) if words else bare(size, len(groups))
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
        self.inset = self.plotter.renderers[len(groups)] if inset is not None else None
        self.panels: list[Panel] = []
        for renderer, group, place in zip(self.plotter.renderers, groups, self.layout.panels, strict=False):
            letters = Lettering(renderer, place.letter)
            self.panels.append(Panel(renderer, group, look, self.limit, letters, mesh, device))
            renderer.camera_set = True
        self.words = Words(self.plotter.render_window, self.layout) if words else None
        self.update()
        self._arrange()
        self.first_view()

    @property
    def letter(self) -> int:
        """Height of letters, pixels."""
        return self.layout.letter

    def resize(self, size: tuple[int, int]) -> None:
        """Fit everything to a window of another size, pixels; drawing is left to the caller."""
        self.size = size
        self._arrange()
        self.first_view()

    def _arrange(self) -> None:
        """Put panels, words and key where they have room for what they say."""
        self.layout = self._new_layout()
        for panel, place in zip(self.panels, self.layout.panels, strict=True):
            panel.renderer.viewport = place.viewport
            panel.ground.resize(place.letter, place.labelled)
            panel.show_ground(self.scale)
        if self.inset is not None and self._inset_place is not None:
            left, bottom, right, top = self._inset_place
            self.inset.viewport = (
                left,
                bottom,
                min(right, self.layout.key_left - 0.006),
                min(top, self.layout.area[3]),
            )
        if self.words is not None:
            self.words.arrange(self.layout)
            self._word(self.words)

    @staticmethod
    def _check(requests: Sequence[LobeRequest], look: LobeStyle) -> None:
        if look.radius not in RADIUS_MODES:
            raise InputError(f"no radius is called {look.radius!r}; there are {', '.join(RADIUS_MODES)}")
        if look.colour not in COLOUR_MODES:
            raise InputError(f"no colour is called {look.colour!r}; there are {', '.join(COLOUR_MODES)}")
        if look.colour == "spectrum":
            for request in requests:
                if request.minus is not None:
                    raise InputError("a difference has no spectral colour; colour it by value")
                check_spectrum(request.subject.wavelength, "colour by value instead")

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
            scales = [make_scale(self.look.radius, f, c, self.look.floor, d) for f, c, d in values]
            self.scale = common_scale(scales) if scales else RadiusScale(self.look.radius, 1.0, 1e-3)
            self.paint = self._value_paint(values)
        else:
            self.scale, self.paint = self.held, self.held_paint
        by_value = self.look.colour == "value"
        for panel in self.panels:
            panel.draw(self.scale, self.paint if by_value else None)
            if not by_value and not self.overlay:
                self._paint_spectra(panel)
        if self.words is not None:
            if self._needs_room():
                self._arrange()
            self._word(self.words)

    def _value_paint(self, values: Sequence[Spanned]) -> ValuePaint:
        """Colours from the smallest to the largest value, down to the floor of a logarithmic radius."""
        low, high = np.inf, 0.0
        for f, _, decades in values:
            good = f[np.isfinite(f) & (f > 0.0)]
            if good.size:
                low = min(low, max(float(good.min()), float(good.max()) * 10.0**-decades))
                high = max(high, float(good.max()))
        if self.look.radius == "log":
            low = max(low, self.scale.floor)
        return value_paint(low if high else 1e-3, high or 1.0, self.panels[0].signed)

    def _needs_room(self) -> bool:
        """Whether notes or captions have become longer than their place."""
        new = self._new_layout()
        return new.area[3] < self.layout.area[3] - 1e-9 or any(
            a.caption_lines > b.caption_lines for a, b in zip(new.panels, self.layout.panels, strict=True)
        )

    def _new_layout(self) -> PictureLayout:
        if not self._worded:
            return bare(self.size, len(self.panels))
        captions = [panel.caption(self.named) for panel in self.panels]
        share = OVERLAY_CAPTION if self.overlay else 1.0
        return arranged(self.size, captions, self.notes(), self._edges, share)

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
            room = characters((0.95 - OVERLAY_CAPTION) * self.size[0], self.letter)
            names = [(self.overlay_name(e, room), Panel.colour_of(k)) for k, e in enumerate(requests)]
            words.key.show_names(names, top=self.layout.area[3])
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

    def overlay_name(self, request: LobeRequest, room: int = 80) -> str:
        """Name of one of several lobes in one panel, in so many letters: what tells it from the others."""
        tail = f"θi = {request.theta_i:g}°, {request.subject.label(request.column)}"
        if not self.named:
            return tail
        return f"{cut_text(request.name, max(4, room - len(tail) - 2))}, {tail}"

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
            reach = min(lobe.reach for lobe in lobes if isinstance(lobe, FittedLobe))
            wild = sum(int(np.count_nonzero(~np.isfinite(lobe.values))) for lobe in lobes)
            out.append(clip_text(self.limit, reach) + (f"; {wild} infinite values cut" if wild else ""))
        if not self.overlay and any(p.marks and p.marks[0].model is not None for p in self.panels):
            behind = any(p.marks and p.marks[0].subject.sees for p in self.panels)
            what = " what the detector sees of the model" if behind else ""
            out[-1] += f".  Whiskers: measured above (orange), below (blue){what}"
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
        if look.radius != self.look.radius or look.floor != self.look.floor:
            self.held = None
        self.look = look
        self.update()

    def hold(self, scale: RadiusScale | None = None, paint: ValuePaint | None = None) -> None:
        """Keep a scale and its colours, by default those shown, while wavelength and incident zenith move."""
        self.held, self.held_paint = scale or self.scale, paint or self.paint
        self.update()

    def release(self) -> None:
        """Let scale and colours follow the values again."""
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
        for panel, place in zip(self.panels, self.layout.panels, strict=True):
            self.view.apply(panel.renderer.camera, *place.pixels)

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()

"""What can be done to a picture, told apart from who does it: a window, a browser or a test."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clbrdf.errors import InputError
from clbrdf.viz.camera import project
from clbrdf.viz.cut import Cut
from clbrdf.viz.directions import angles_of
from clbrdf.viz.lobes import FittedLobe, MeasuredLobe
from clbrdf.viz.marks import Marks
from clbrdf.viz.panel import Panel
from clbrdf.viz.picture import Picture
from clbrdf.viz.radius import RADIUS_MODES
from clbrdf.viz.style import COLOUR_MODES

SNAP = 0.75
"""Degrees within which the incident angle jumps to one that was measured."""
REACH = 12.0
"""Pixels within which a click takes a measured point."""


class Control:
    """Sliders, keys and clicks of a picture.

    Parameters
    ----------
    picture : Picture
    cut : Cut, optional
        Kept in step with the picture.
    redraw : callable, optional
        Called after every change.
    """

    def __init__(
        self, picture: Picture, cut: Cut | None = None, redraw: Callable[[], None] | None = None
    ) -> None:
        self.picture, self.cut = picture, cut
        self.redraw = redraw or picture.render
        self.message = ""
        self._show_cut()

    @property
    def wavelengths(self) -> list[float]:
        """Wavelengths the slider stops at, nm."""
        return [float(w) for w in self.picture.panels[0].requests[0].subject.wavelength]

    @property
    def wavelength(self) -> float:
        """Wavelength shown, nm."""
        request = self.picture.panels[0].requests[0]
        return float(request.subject.wavelength[request.column])

    @property
    def theta_i(self) -> float:
        """Incident zenith shown, degrees."""
        return self.picture.panels[0].requests[0].theta_i

    @property
    def largest_incident(self) -> float:
        """Upper end of the incident angle's slider, degrees."""
        return float(np.floor(self.picture.limit))

    @property
    def spectral_label(self) -> str:
        """What is shown: "λ = 550 nm", or the name of a band."""
        request = self.picture.panels[0].requests[0]
        label = request.subject.label(request.column)
        return f"band {label}" if request.subject.scan.bands else f"λ = {label}"

    def set_wavelength(self, wavelength: float) -> None:
        """Show the measured wavelength nearest to one in nm."""
        nearest = min(self.wavelengths, key=lambda w: abs(w - wavelength))
        if nearest != self.wavelength:
            self.picture.set(wavelength=nearest)
            self._changed()

    def set_incident(self, theta_i: float) -> None:
        """Show an incident zenith in degrees; one that was measured, if it is near."""
        measured = self.picture.panels[0].requests[0].subject.scan.incident_angles
        nearest = float(measured[np.abs(measured - theta_i).argmin()])
        angle = nearest if abs(nearest - theta_i) <= SNAP else round(float(theta_i), 1)
        angle = float(np.clip(angle, 0.0, self.picture.limit))
        if angle != self.theta_i:
            self.picture.set(theta_i=angle)
            self._changed()

    def next_radius(self) -> None:
        """Go on to the next meaning of the radius."""
        place = RADIUS_MODES.index(self.picture.look.radius)
        self.picture.restyle(radius=RADIUS_MODES[(place + 1) % len(RADIUS_MODES)])
        self._changed()

    def next_colour(self) -> None:
        """Go on to the next meaning of the colour, where the scan has it."""
        place = COLOUR_MODES.index(self.picture.look.colour)
        try:
            self.picture.restyle(colour=COLOUR_MODES[(place + 1) % len(COLOUR_MODES)])
        except InputError as error:
            self.say(str(error))
        self._changed()

    def toggle_points(self) -> None:
        """Show or hide the measured points."""
        for panel in self.picture.panels:
            for marks in panel.marks:
                marks.visible = not marks.visible
        self._changed()

    def toggle_hold(self) -> None:
        """Hold the scale while sliders move, or let it follow the values again."""
        if self.picture.held:
            self.picture.release()
        else:
            self.picture.hold()
        self._changed()

    def first_view(self) -> None:
        """Go back to the first camera position."""
        self.picture.first_view()
        self._changed()

    def resize(self, size: tuple[int, int]) -> None:
        """Fit picture and cut to a window of another size, pixels; who resizes the window draws it."""
        self.picture.resize(size)
        if self.cut is not None:
            self.cut.resize(self.picture.letter)
        self._show_cut()

    def say(self, text: str) -> None:
        """Put a line at the foot of the picture."""
        self.message = text
        self.picture.say(text)

    def _changed(self) -> None:
        self._show_cut()
        self.redraw()

    def _show_cut(self) -> None:
        if self.cut is None:
            return
        requests = [e for p in self.picture.panels for e in p.requests]
        lobes = [lobe for p in self.picture.panels for lobe in p.lobes]
        widths = [lobe.mesh.width if isinstance(lobe, FittedLobe) else 0.3 for lobe in lobes]
        self.cut.show(requests, widths, self.picture.look.radius == "log")

    def pick(self, x: float, y: float) -> str:
        """Read out what lies at a pixel, counted from the lower left corner of the window.

        A measured point within REACH is preferred to the surface. Returns the line shown, "" for none.
        """
        text = ""
        for panel in self.picture.panels:
            if panel.renderer.IsInViewport(int(x), int(y)):
                text = self._pick_mark(panel, x, y) or self._pick_surface(panel, x, y)
        self.say(text)
        self.redraw()
        return text

    @staticmethod
    def _pick_mark(panel: Panel, x: float, y: float) -> str:
        for marks in panel.marks:
            if not len(marks.rows) or not marks.visible:
                continue
            away = np.hypot(*(project(panel.renderer, marks.positions) - [x, y]).T)
            if away.min() <= REACH:
                return mark_text(marks, int(away.argmin()))
        return ""

    @staticmethod
    def _pick_surface(panel: Panel, x: float, y: float) -> str:
        if not panel.there[0] or not isinstance(panel.lobes[0], FittedLobe | MeasuredLobe):
            return ""
        from vtkmodules.vtkRenderingCore import vtkCellPicker

        # By geometry: the depth buffer is gone once the words have been drawn over the panels.
        picker = vtkCellPicker()
        picker.SetTolerance(1e-5)
        picker.PickFromListOn()
        for actor in panel.actors:
            picker.AddPickList(actor)
        if not picker.Pick(x, y, 0.0, panel.renderer):
            return ""
        zenith, azimuth = (float(a) for a in angles_of(picker.GetPickPosition()))
        place = panel.actors.index(picker.GetActor()) if picker.GetActor() in panel.actors else 0
        request = panel.requests[place]
        where = f"{request.name}: θr = {zenith:.2f}°, φ = {azimuth:.1f}°"
        if isinstance(panel.lobes[place], FittedLobe) and request.minus is None:
            subject = request.subject
            direction = subject.directions([request.theta_i], [min(zenith, 89.99)], [azimuth])
            value = subject.model_values(request.column, direction)[0]
            return f"{where}: model {value:.4g} 1/sr"
        return f"{where}: between measured points"


def mark_text(marks: Marks, place: int) -> str:
    """Say angles, value, uncertainty, model and residual of a measured point."""
    scan, row = marks.subject.scan, int(marks.rows[place])
    value = scan.brdf[row, marks.column]
    sigma = np.nan if scan.sigma is None else scan.sigma[row, marks.column]
    error = f" ± {sigma:.2g}" if np.isfinite(sigma) else ""
    text = (
        f"{marks.subject.name}: θr = {scan.theta_r[row]:.2f}°, φ = {scan.phi[row]:.1f}°:"
        f" measured {value:.4g}{error} 1/sr"
    )
    model = marks.model
    if model is None:
        return text
    residual = 100.0 * (model[place] / value - 1.0)
    name = "model as seen" if marks.subject.sees else "model"
    return f"{text}, {name} {model[place]:.4g} 1/sr, residual {residual:+.1f} %"

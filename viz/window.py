"""The interactive window: a picture with sliders, keys, clicks and the linked cut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from clbrdf.opencl.device import Device
from clbrdf.viz.control import Control
from clbrdf.viz.cut import Cut
from clbrdf.viz.lettering import FONT_FROM_FILE, font_file
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.picture import MOVING_SAMPLES, Picture
from clbrdf.viz.style import LobeStyle

PANEL_AREA = (0.0, 0.16, 0.60, 0.89)
CUT_AREA = (0.585, 0.15, 0.882, 0.80)

KEYS = "keys: l radius, c colour, m measured points, h hold the scale, i first view, q quit; click a point"
CLICK_REACH = 4.0
"""Pixels the mouse may move between press and release of a click."""


def controlled_picture(
    requests: Sequence[LobeRequest],
    look: LobeStyle,
    size: tuple[int, int],
    *,
    overlay: bool = False,
    off_screen: bool = False,
    device: Device | None = None,
) -> Control:
    """Return a picture with the linked cut beside it, and its control."""
    picture = Picture(
        requests,
        look,
        size=size,
        overlay=overlay,
        off_screen=off_screen,
        area=PANEL_AREA,
        inset=CUT_AREA,
        samples=MOVING_SAMPLES,
        device=device,
    )
    return Control(picture, Cut(picture.inset, picture.limit, picture.letter))


class Window:
    """Sliders, keys and clicks of VTK, connected to a control.

    Parameters
    ----------
    control : Control
    """

    def __init__(self, control: Control) -> None:
        self.control = control
        picture = control.picture
        self.keys: dict[str, Callable[[], None]] = {
            "l": control.next_radius,
            "c": control.next_colour,
            "m": control.toggle_points,
            "h": control.toggle_hold,
            "i": control.first_view,
        }
        for key, action in self.keys.items():
            picture.plotter.add_key_event(key, action)
        self.interactor = picture.plotter.iren.interactor
        self.wavelength_slider: Any = None
        if len(control.wavelengths) > 1:
            span = control.wavelengths[0], control.wavelengths[-1]
            self.wavelength_slider = self._slider(span, control.wavelength, 0.03, self._wavelength)
        self.incident_slider: Any = None
        if any(e.subject.fit is not None for p in picture.panels for e in p.requests) or (
            len(picture.panels[0].requests[0].subject.scan.incident_angles) > 1
        ):
            span = 0.0, control.largest_incident
            self.incident_slider = self._slider(span, control.theta_i, 0.33, self._incident)
        self._pressed = (0, 0)
        self.interactor.AddObserver("LeftButtonPressEvent", self._press, 1.0)
        # The style takes the focus when a button goes down, and nobody else hears of its release; it says so
        # itself, of a click as of a drag.
        self.interactor.GetInteractorStyle().AddObserver("EndInteractionEvent", self._release)
        # Letters have a height in pixels: a window that becomes smaller has to be laid out anew.
        picture.plotter.render_window.AddObserver("WindowResizeEvent", self._resized)
        control.say(KEYS)
        self._say_values()
        # A click before the first picture would find sliders without a shape, and VTK would end.
        picture.render()

    def _slider(
        self, span: tuple[float, float], value: float, left: float, action: Callable[..., None]
    ) -> Any:
        from vtkmodules.vtkInteractionWidgets import vtkSliderRepresentation2D, vtkSliderWidget

        shape = vtkSliderRepresentation2D()
        shape.SetMinimumValue(span[0])
        shape.SetMaximumValue(span[1])
        shape.SetValue(value)
        # The slider stops between measured values; its title says what is shown.
        shape.ShowSliderLabelOff()
        for place, end in (
            (shape.GetPoint1Coordinate(), (left, 0.115)),
            (shape.GetPoint2Coordinate(), (left + 0.26, 0.115)),
        ):
            place.SetCoordinateSystemToNormalizedDisplay()
            place.SetValue(*end)
        shape.SetTitleHeight(0.022)
        shape.SetSliderLength(0.012)
        shape.SetSliderWidth(0.03)
        shape.SetTubeWidth(0.006)
        letters = shape.GetTitleProperty()
        letters.SetFontFamily(FONT_FROM_FILE)
        letters.SetFontFile(font_file())
        letters.SetColor(0.0, 0.0, 0.0)
        letters.ShadowOff()
        letters.BoldOff()
        letters.ItalicOff()
        shape.GetTubeProperty().SetColor(0.6, 0.6, 0.6)
        shape.GetSliderProperty().SetColor(0.0, 0.45, 0.70)
        words = self.control.picture.words
        assert words is not None
        widget = vtkSliderWidget()
        widget.SetInteractor(self.interactor)
        widget.SetRepresentation(shape)
        widget.SetCurrentRenderer(words.renderer)
        widget.SetDefaultRenderer(words.renderer)
        widget.SetAnimationModeToJump()
        widget.EnabledOn()
        widget.AddObserver("InteractionEvent", action)
        return widget

    def _wavelength(self, widget: Any, event: str) -> None:
        del event
        self.control.set_wavelength(float(widget.GetRepresentation().GetValue()))
        self._say_values()

    def _incident(self, widget: Any, event: str) -> None:
        del event
        self.control.set_incident(float(widget.GetRepresentation().GetValue()))
        self._say_values()

    def _say_values(self) -> None:
        for slider, text in (
            (self.wavelength_slider, self.control.spectral_label),
            (self.incident_slider, f"θi = {self.control.theta_i:g}°"),
        ):
            if slider is not None:
                slider.GetRepresentation().SetTitleText(text)

    def _resized(self, window: Any, event: str) -> None:
        del event
        size = tuple(window.GetSize())
        if min(size) > 0 and size != self.control.picture.size:
            self.control.resize((size[0], size[1]))

    def _press(self, interactor: Any, event: str) -> None:
        del event
        self._pressed = interactor.GetEventPosition()

    def _release(self, style: Any, event: str) -> None:
        del style, event
        x, y = self.interactor.GetEventPosition()
        if max(abs(x - self._pressed[0]), abs(y - self._pressed[1])) <= CLICK_REACH:
            self.control.pick(x, y)

    def show(self) -> None:
        """Open the window and stay until it is closed."""
        self.control.picture.plotter.show(title="clbrdf")

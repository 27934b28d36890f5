"""One panel of a picture: the ground with one lobe, or several laid over each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.opencl.device import Device
from clbrdf.viz.curves import model_word
from clbrdf.viz.ground import Ground
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.lobes import FittedLobe, Lobe, MeasuredLobe, Paint, reference_values
from clbrdf.viz.marks import Marks
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import compared_text, peak_text, points_text
from clbrdf.viz.radius import DECADES, RadiusScale
from clbrdf.viz.style import SERIES, LobeStyle, rgb
from clbrdf.viz.subject import Subject, lobe_width

Array = npt.NDArray[np.float64]

Spanned = tuple[npt.NDArray[np.floating], npt.NDArray[np.floating], float]
"""Values, cosines of their view zenith, and the decades that a logarithmic radius may span."""

OUTLINE = "#3a3a3a"
POINT = 0.38
"""Diameter of a measured point, in letters."""
MEASURED_DECADES = 30.0
"""Span of a logarithmic radius of measured values: all of them."""


@dataclass(frozen=True)
class LobeRequest:
    """One lobe: of what, where, and minus what.

    Attributes
    ----------
    subject : Subject
    wavelength : float
        nm; the nearest measured one is shown.
    theta_i : float
        Incident zenith, degrees.
    minus : Subject or None
        What is subtracted.
    """

    subject: Subject
    wavelength: float
    theta_i: float
    minus: Subject | None = None

    @property
    def column(self) -> int:
        """Place of the wavelength shown."""
        return self.subject.column(self.wavelength)

    @property
    def name(self) -> str:
        """What is shown, with the sign of a difference."""
        if self.minus is None:
            return self.subject.name
        if self.minus is self.subject:
            fit = self.subject.fit
            return f"{self.subject.name}: measured − {'model' if fit is None else model_word(fit)}"
        return f"{self.subject.name} − {self.minus.name}"


def make_lobe(request: LobeRequest, mesh: LobeMesh, device: Device | None) -> Lobe:
    """Return the surface asked for: the model's where there is one on both sides, else the measured one."""
    fitted = request.subject.fit is not None
    if request.minus is None:
        return FittedLobe(request.subject, mesh, device) if fitted else MeasuredLobe(request.subject)
    if fitted and request.minus.fit is not None and request.minus is not request.subject:
        return FittedLobe(request.subject, mesh, device, request.minus)
    return MeasuredLobe(request.subject, request.minus)


def check_difference(request: LobeRequest) -> None:
    """Raise InputError where a request subtracts measured values that have no direction in common."""
    if request.minus is None or (request.minus.fit is not None):
        return
    rows = request.subject.rows(request.theta_i)
    if not np.isfinite(reference_values(request.minus, request.subject, rows, request.column)).any():
        raise InputError(
            f"{request.subject.name} and {request.minus.name} have no direction in common at θi ="
            f" {request.theta_i:g}°; fit one of them, and take the difference to its fit"
        )


class Panel:
    """Lobes of some requests in one renderer.

    Parameters
    ----------
    renderer : vtkRenderer
    requests : sequence of LobeRequest
        More than one are laid over each other as nets, each in its own colour.
    look : LobeStyle
    limit : float
        View zenith where meshes end, degrees.
    letters : Lettering
    mesh : LobeMesh, optional
        For all models here; by default refined for the narrowest lobe of each.
    device : Device, optional
    """

    def __init__(
        self,
        renderer: Any,
        requests: Sequence[LobeRequest],
        look: LobeStyle,
        limit: float,
        letters: Lettering,
        mesh: LobeMesh | None = None,
        device: Device | None = None,
    ) -> None:
        self.renderer, self.requests, self.look, self.limit = renderer, list(requests), look, limit
        self.ground = Ground(renderer, letters)
        self.lobes: list[Lobe] = []
        self.actors: list[Any] = []
        self.outlines: list[Any] = []
        self._outlined: list[int] = []
        self.marks: list[Marks] = []
        for k, request in enumerate(self.requests):
            own = mesh or LobeMesh(
                lobe_width(request.subject, min(request.theta_i, limit)),
                limit,
                even=not _anisotropic(request),
            )
            lobe = make_lobe(request, own, device)
            self.lobes.append(lobe)
            self.actors.append(self._actor(lobe, k))
            if look.points and request.minus is None:
                colour = self.colour_of(k) if len(self.requests) > 1 else ""
                size = max(3.0, POINT * letters.size)
                self.marks.append(Marks(renderer, request.subject, size, colour))
        self.there = [False] * len(self.lobes)

    def _actor(self, lobe: Lobe, place: int) -> Any:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        mapper = vtkPolyDataMapper()
        mapper.SetInputData(lobe.polydata)
        mapper.SetColorModeToDirectScalars()
        actor = vtkActor()
        actor.SetMapper(mapper)
        shape = actor.GetProperty()
        shape.SetAmbient(0.35)
        shape.SetDiffuse(0.70)
        shape.SetSpecular(0.0)
        shape.SetLineWidth(2.0)
        if isinstance(lobe, MeasuredLobe):
            shape.SetAmbient(0.8)
            shape.SetDiffuse(0.25)
        if len(self.requests) > 1:
            # Surfaces laid over each other would hide or tint one another: each is a net in its own colour.
            mapper.SetInputData(lobe.net if lobe.net is not None else lobe.polydata)
            mapper.ScalarVisibilityOff()
            shape.SetColor(*rgb(self.colour_of(place)))
            shape.SetRepresentationToWireframe()
            shape.SetLineWidth(1.0)
            shape.LightingOff()
        self.renderer.AddActor(actor)
        if lobe.outline is not None:
            self.outlines.append(self._outline(lobe.outline, self.colour_of(place)))
            self._outlined.append(place)
        return actor

    def _outline(self, data: Any, colour: str) -> Any:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        mapper = vtkPolyDataMapper()
        mapper.SetInputData(data)
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        shape = actor.GetProperty()
        shape.SetColor(*rgb(colour if len(self.requests) > 1 else OUTLINE))
        shape.SetLineWidth(3.0 if len(self.requests) > 1 else 1.5)
        shape.LightingOff()
        actor.PickableOff()
        self.renderer.AddActor(actor)
        return actor

    @staticmethod
    def colour_of(place: int) -> str:
        """Colour of one of several lobes laid over each other."""
        return SERIES[place % len(SERIES)]

    @property
    def signed(self) -> bool:
        """Whether differences are shown."""
        return self.requests[0].minus is not None

    def set(self, wavelength: float | None = None, theta_i: float | None = None) -> None:
        """Go to another wavelength (nm) or incident zenith (degrees)."""
        if wavelength is not None:
            self.requests = [replace(e, wavelength=wavelength) for e in self.requests]
        if theta_i is not None:
            self.requests = [replace(e, theta_i=theta_i) for e in self.requests]

    def evaluate(self) -> list[Spanned]:
        """Find all values; return those that data hold, for a common scale.

        Each with the cosines of its view zenith and the decades that a logarithmic radius may span.
        """
        found = []
        for k, (request, lobe) in enumerate(zip(self.requests, self.lobes, strict=True)):
            self.there[k] = lobe.evaluate(request.column, request.theta_i)
            if self.there[k]:
                values, cos_r = lobe.held_by_data()
                span = DECADES if isinstance(lobe, FittedLobe) or self.signed else MEASURED_DECADES
                found.append((np.abs(values) if self.signed else values, cos_r, span))
        for request, marks in zip(self.requests, self.marks, strict=False):
            marks.find(request.column, request.theta_i)
            if len(marks.rows):
                found.append((marks.values, marks.cos_r, MEASURED_DECADES))
        return found

    def draw(self, scale: RadiusScale, paint: Paint | None) -> None:
        """Give everything the lengths and colours of a scale."""
        one = paint if len(self.requests) == 1 else None
        for lobe, actor, there in zip(self.lobes, self.actors, self.there, strict=True):
            actor.SetVisibility(there)
            if there:
                lobe.draw(scale, one)
        for place, actor in zip(self._outlined, self.outlines, strict=True):
            actor.SetVisibility(self.there[place])
        for marks in self.marks:
            marks.draw(scale)
        self.show_ground(scale)

    def show_ground(self, scale: RadiusScale) -> None:
        """Draw incident and mirror directions and the bar of a scale."""
        angles = tuple(dict.fromkeys(e.theta_i for e in self.requests))
        self.ground.show(angles, scale, self.signed)

    def caption(self, named: bool = False) -> str:
        """Words of this panel: what (by name where there are several), where, the peak, the points."""
        request = self.requests[0]
        columns = dict.fromkeys(e.subject.label(e.column) for e in self.requests)
        angles = dict.fromkeys(f"{e.theta_i:g}°" for e in self.requests)
        kind = "band" if request.subject.scan.bands else "λ"
        turned = f",  φi = {request.subject.phi_i:g}°" if request.subject.anisotropic else ""
        who = f"{request.name}:  " if named and len(self.requests) == 1 else ""
        lines = [
            f"{who}θi = {', '.join(angles)}{turned},  {kind} = {', '.join(columns)}"
            + self._subtracted(request)
        ]
        if len(self.requests) > 1:
            return lines[0]
        if self.there[0]:
            lobe = self.lobes[0]
            vectors = np.asarray(lobe.vectors).reshape(-1, 3)
            limit = self.limit if isinstance(lobe, FittedLobe) else None
            lines.append(peak_text(np.ravel(lobe.values), vectors, limit, self.signed))
            if isinstance(lobe, MeasuredLobe) and lobe.other is not None:
                lines.append(compared_text(lobe.compared, lobe.asked))
        else:
            lines.append("nothing fitted or measured here")
        lines += [
            points_text(request.subject, request.theta_i, len(m.rows), m.masked, len(m.drawn))
            for m in self.marks
        ]
        return "\n".join(lines)

    @staticmethod
    def _subtracted(request: LobeRequest) -> str:
        """Name the wavelength of what is subtracted where it is another one."""
        here = request.subject.label(request.column)
        if request.minus is None or request.minus is request.subject:
            return ""
        theirs = request.minus.column(float(request.subject.wavelength[request.column]))
        label = request.minus.label(theirs)
        return "" if label == here else f" minus {label}"


def _anisotropic(request: LobeRequest) -> bool:
    """Whether a lobe has no mirror symmetry: its model, or what is subtracted, tells azimuths apart."""
    return request.subject.anisotropic or (request.minus is not None and request.minus.anisotropic)

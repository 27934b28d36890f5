"""One panel of a picture: the ground with one lobe, or several laid over each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.opencl.device import Device
from clbrdf.viz.ground import Ground
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.lobes import FittedLobe, Lobe, MeasuredLobe, Paint, reference_values
from clbrdf.viz.marks import Marks
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import peak_text, points_text
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.style import SERIES, Look, rgb
from clbrdf.viz.subject import Subject, lobe_width

Array = npt.NDArray[np.float64]

OUTLINE = "#3a3a3a"
MANY_POINTS = 150
"""From here on measured points are drawn smaller, so that the surface is seen."""


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
            return f"{self.subject.name}: measured − model"
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
        More than one are laid over each other, half transparent, each in its own colour.
    look : Look
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
        look: Look,
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
            if look.points and request.minus is None and len(self.requests) == 1:
                many = len(request.subject.rows(request.theta_i)) > MANY_POINTS
                size = max(3.0, (0.24 if many else 0.38) * letters.size)
                self.marks.append(Marks(renderer, request.subject, size))
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
            mapper.ScalarVisibilityOff()
            shape.SetColor(*rgb(self.colour_of(place)))
            shape.SetOpacity(0.45)
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
        shape.SetLineWidth(1.5)
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

    def evaluate(self) -> list[tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]]]:
        """Find all values; return them with the cosines of their view zenith, for a common scale."""
        found = []
        for k, (request, lobe) in enumerate(zip(self.requests, self.lobes, strict=True)):
            self.there[k] = lobe.evaluate(request.column, request.theta_i)
            if self.there[k]:
                found.append((np.abs(lobe.values) if self.signed else lobe.values, lobe.cos_r))
        for request, marks in zip(self.requests, self.marks, strict=False):
            marks.find(request.column, request.theta_i)
            if len(marks.rows):
                found.append((marks.values, marks.cos_r))
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
        lines = [f"{who}θi = {', '.join(angles)}{turned},  {kind} = {', '.join(columns)}"]
        if len(self.requests) > 1:
            return lines[0]
        if self.there[0]:
            lobe = self.lobes[0]
            vectors = np.asarray(lobe.vectors).reshape(-1, 3)
            limit = self.limit if isinstance(lobe, FittedLobe) else None
            lines.append(peak_text(np.ravel(lobe.values), vectors, limit, self.signed))
        else:
            lines.append("nothing fitted or measured here")
        lines += [points_text(request.subject, request.theta_i, len(m.rows), m.masked) for m in self.marks]
        return "\n".join(lines)


def _anisotropic(request: LobeRequest) -> bool:
    """Whether a lobe has no mirror symmetry: its model, or what is subtracted, tells azimuths apart."""
    return request.subject.anisotropic or (request.minus is not None and request.minus.anisotropic)

"""One picture within a figure: a stage with one lobe, or several laid over each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.opencl.device import Device
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.lobes import FittedLobe, Lobe, MeasuredLobe, Paint, reference_values
from clbrdf.viz.marks import Marks
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.notes import peak_text, points_text
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.stage import Stage
from clbrdf.viz.style import SERIES, Look, rgb
from clbrdf.viz.subject import Subject, lobe_width

Array = npt.NDArray[np.float64]

OUTLINE = "#3a3a3a"
MANY_POINTS = 150
"""From here on measured points are drawn smaller, so that the surface is seen."""


@dataclass(frozen=True)
class Entry:
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


def make_lobe(entry: Entry, mesh: LobeMesh, device: Device | None) -> Lobe:
    """Return the surface of an entry: the model's where there is one on both sides, else the measured one."""
    fitted = entry.subject.fit is not None
    if entry.minus is None:
        return FittedLobe(entry.subject, mesh, device) if fitted else MeasuredLobe(entry.subject)
    if fitted and entry.minus.fit is not None and entry.minus is not entry.subject:
        return FittedLobe(entry.subject, mesh, device, entry.minus)
    return MeasuredLobe(entry.subject, entry.minus)


def check_difference(entry: Entry) -> None:
    """Raise InputError where an entry subtracts measured values that have no direction in common."""
    if entry.minus is None or (entry.minus.fit is not None):
        return
    rows = entry.subject.rows(entry.theta_i)
    if not np.isfinite(reference_values(entry.minus, entry.subject, rows, entry.column)).any():
        raise InputError(
            f"{entry.subject.name} and {entry.minus.name} have no direction in common at θi ="
            f" {entry.theta_i:g}°; fit one of them, and take the difference to its fit"
        )


class Panel:
    """Lobes of some entries in one renderer.

    Parameters
    ----------
    renderer : vtkRenderer
    entries : sequence of Entry
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
        entries: Sequence[Entry],
        look: Look,
        limit: float,
        letters: Lettering,
        mesh: LobeMesh | None = None,
        device: Device | None = None,
    ) -> None:
        self.renderer, self.entries, self.look, self.limit = renderer, list(entries), look, limit
        self.stage = Stage(renderer, letters)
        self.lobes: list[Lobe] = []
        self.actors: list[Any] = []
        self.outlines: list[Any] = []
        self._outlined: list[int] = []
        self.marks: list[Marks] = []
        for k, entry in enumerate(self.entries):
            own = mesh or LobeMesh(
                lobe_width(entry.subject, min(entry.theta_i, limit)),
                limit,
                even=not _anisotropic(entry),
            )
            lobe = make_lobe(entry, own, device)
            self.lobes.append(lobe)
            self.actors.append(self._actor(lobe, k))
            if look.points and entry.minus is None and len(self.entries) == 1:
                many = len(entry.subject.rows(entry.theta_i)) > MANY_POINTS
                size = max(3.0, (0.24 if many else 0.38) * letters.size)
                self.marks.append(Marks(renderer, entry.subject, size))
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
        if len(self.entries) > 1:
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
        shape.SetColor(*rgb(colour if len(self.entries) > 1 else OUTLINE))
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
        return self.entries[0].minus is not None

    def set(self, wavelength: float | None = None, theta_i: float | None = None) -> None:
        """Go to another wavelength (nm) or incident zenith (degrees)."""
        if wavelength is not None:
            self.entries = [replace(e, wavelength=wavelength) for e in self.entries]
        if theta_i is not None:
            self.entries = [replace(e, theta_i=theta_i) for e in self.entries]

    def evaluate(self) -> list[tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]]]:
        """Find all values; return them with the cosines of their view zenith, for a common scale."""
        found = []
        for k, (entry, lobe) in enumerate(zip(self.entries, self.lobes, strict=True)):
            self.there[k] = lobe.evaluate(entry.column, entry.theta_i)
            if self.there[k]:
                found.append((np.abs(lobe.values) if self.signed else lobe.values, lobe.cos_r))
        for entry, marks in zip(self.entries, self.marks, strict=False):
            marks.find(entry.column, entry.theta_i)
            if len(marks.rows):
                found.append((marks.values, marks.cos_r))
        return found

    def draw(self, scale: RadiusScale, paint: Paint | None) -> None:
        """Give everything the lengths and colours of a scale."""
        one = paint if len(self.entries) == 1 else None
        for lobe, actor, there in zip(self.lobes, self.actors, self.there, strict=True):
            actor.SetVisibility(there)
            if there:
                lobe.draw(scale, one)
        for place, actor in zip(self._outlined, self.outlines, strict=True):
            actor.SetVisibility(self.there[place])
        for marks in self.marks:
            marks.draw(scale)
        angles = tuple(dict.fromkeys(e.theta_i for e in self.entries))
        self.stage.show(angles, scale, self.signed)

    def caption(self, named: bool = False) -> str:
        """Words of this picture: what (by name where there are several), where, the peak, the points."""
        entry = self.entries[0]
        columns = dict.fromkeys(e.subject.label(e.column) for e in self.entries)
        angles = dict.fromkeys(f"{e.theta_i:g}°" for e in self.entries)
        kind = "band" if entry.subject.scan.bands else "λ"
        turned = f",  φi = {entry.subject.phi_i:g}°" if entry.subject.anisotropic else ""
        who = f"{entry.name}:  " if named and len(self.entries) == 1 else ""
        lines = [f"{who}θi = {', '.join(angles)}{turned},  {kind} = {', '.join(columns)}"]
        if len(self.entries) > 1:
            return lines[0]
        if self.there[0]:
            lobe = self.lobes[0]
            vectors = np.asarray(lobe.vectors).reshape(-1, 3)
            limit = self.limit if isinstance(lobe, FittedLobe) else None
            lines.append(peak_text(np.ravel(lobe.values), vectors, limit, self.signed))
        else:
            lines.append("nothing fitted or measured here")
        lines += [points_text(entry.subject, entry.theta_i, len(m.rows), m.masked) for m in self.marks]
        return "\n".join(lines)


def _anisotropic(entry: Entry) -> bool:
    """Whether a lobe has no mirror symmetry: its model, or what is subtracted, tells azimuths apart."""
    return entry.subject.anisotropic or (entry.minus is not None and entry.minus.anisotropic)

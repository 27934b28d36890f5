"""How long a step of a slider takes: evaluation and update of the mesh, and the whole redraw."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clbrdf.opencl.device import Device
from clbrdf.viz.graphics import require_off_screen
from clbrdf.viz.mesh import LobeMesh
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.subject import Subject, drawing_limit, lobe_width


@dataclass(frozen=True)
class StepTimes:
    """Medians of one kind of slider step, milliseconds.

    Attributes
    ----------
    slider : str
        "wavelength" or "theta-i".
    points : int
        Of the mesh.
    lobe : float
        Evaluation on the device and update of points, normals and colours in place.
    update : float
        The same with scale, ground, marks and words.
    redraw : float
        Update and drawing.
    """

    slider: str
    points: int
    lobe: float
    update: float
    redraw: float


def mesh_of(points: int, width: float, limit: float) -> LobeMesh:
    """Return a mesh of about so many points with as many rings as sectors all around."""
    sectors = max(8, round((points / 4.0) ** 0.5))
    return LobeMesh(width, limit, rings=max(8, round(points / (2 * sectors)) - 1), sectors=sectors)


def step_times(
    subject: Subject,
    points: int | None = 100_000,
    size: tuple[int, int] = (1200, 900),
    steps: int = 21,
    device: Device | None = None,
) -> list[StepTimes]:
    """Measure steps of both sliders.

    Parameters
    ----------
    subject : Subject
        With a fit.
    points : int or None
        Size of the mesh; None takes the default mesh, refined where the lobe needs it.
    size : (int, int)
        Pixels.
    steps : int
        Of each slider.
    device : Device, optional

    Raises
    ------
    GraphicsError
        No OpenGL here.
    """
    require_off_screen()
    from clbrdf.viz.picture import MOVING_SAMPLES, Picture

    request = LobeRequest(subject, subject.default_wavelength(), subject.default_incident())
    limit = drawing_limit([subject])
    mesh = None if points is None else mesh_of(points, lobe_width(subject, request.theta_i), limit)
    picture = Picture([request], size=size, samples=MOVING_SAMPLES, mesh=mesh, device=device)
    picture.render()
    lobe = picture.panels[0].lobes[0]
    waves = np.resize(subject.wavelength, steps)
    angles = np.linspace(20.0, 60.0, steps)
    out = []
    for slider in ("wavelength", "theta-i"):

        def move(k: int, slider: str = slider) -> None:
            picture.set(**({"wavelength": waves[k]} if slider == "wavelength" else {"theta_i": angles[k]}))

        def shape(k: int, slider: str = slider) -> None:
            column = subject.column(waves[k]) if slider == "wavelength" else request.column
            lobe.evaluate(column, request.theta_i if slider == "wavelength" else angles[k])
            lobe.draw(picture.scale, picture.paint)

        def draw(k: int, move: Callable[[int], None] = move) -> None:
            move(k)
            picture.render()

        times = [1e3 * _median(action, steps) for action in (shape, move, draw)]
        out.append(StepTimes(slider, lobe.polydata.n_points, *times))
    picture.close()
    return out


def _median(action: Callable[[int], None], steps: int) -> float:
    taken = []
    for k in range(steps):
        start = time.perf_counter()
        action(k)
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))

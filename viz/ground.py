"""What a lobe stands on: ground disc, angle rings, incident and mirror direction, scale bar.

Lengths are those of the lobes: 1 is the largest value. A ring at sin θ lies under every point of length 1
at zenith θ; the arc of radius 1 in the plane of incidence carries the zenith angles.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.directions import unit_vectors
from clbrdf.viz.lettering import Lettering
from clbrdf.viz.radius import RadiusScale
from clbrdf.viz.style import BLACK, GREY, PALE, VERMILION, rgb

Array = npt.NDArray[np.float64]

RINGS = (15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
BAR_PLACE = np.array([-1.24, 0.0, 0.0])
BAR_TICK = 0.03
BEYOND = 1.13
"""Length of the lines of the incident and the mirror direction: past the longest lobe."""
STEEP, SLANTING = 12.0, 54.0
"""Incident zeniths, degrees, below and above which the words of the two directions stand elsewhere."""


class Ground:
    """The fixed surroundings of a lobe in one renderer, and what follows the incident angle and the scale.

    Parameters
    ----------
    renderer : vtkRenderer
    letters : Lettering
    """

    def __init__(self, renderer: Any, letters: Lettering) -> None:
        self.renderer, self.letters = renderer, letters
        self._draw_ground()
        self._incident = self._add(_empty(), VERMILION, width=3.0)
        self._mirror = self._add(_empty(), BLACK, width=1.5)
        self._bar = self._add(_empty(), BLACK, width=2.0)
        self._incident_label = letters.add("incident", (0.0, 0.0, 0.0), "#a04000")
        self._mirror_label = letters.add("mirror", (0.0, 0.0, 0.0), BLACK)
        self._bar_labels: list[Any] = []
        self._drawn: tuple[object, ...] = ()
        self.labelled = True

    def _add(self, data: Any, colour: str, width: float = 1.0, opacity: float = 1.0) -> Any:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

        mapper = vtkPolyDataMapper()
        mapper.SetInputData(data)
        mapper.ScalarVisibilityOff()
        actor = vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*rgb(colour))
        look.SetLineWidth(width * min(1.0, self.letters.size / 14.0))
        look.SetOpacity(opacity)
        look.LightingOff()
        actor.PickableOff()
        self.renderer.AddActor(actor)
        return actor

    def _draw_ground(self) -> None:
        import pyvista as pv

        around = np.linspace(0.0, 360.0, 121)
        rim = unit_vectors(90.0, around)[:-1] * [1.0, 1.0, 0.0] - [0.0, 0.0, 0.004]
        disc = pv.PolyData(rim, faces=np.append(len(rim), np.arange(len(rim))))
        self._add(disc, PALE)
        rings = [unit_vectors(t, around) * [1.0, 1.0, 0.0] for t in RINGS]
        spokes = [
            np.vstack([np.zeros(3), unit_vectors(90.0, a) * [1.0, 1.0, 0.0]]) for a in range(0, 360, 45)
        ]
        self._add(_lines(rings + spokes), "#b5b5b5", width=1.0)
        zeniths = np.linspace(0.0, 90.0, 46)
        arc = np.vstack([unit_vectors(zeniths[::-1], 0.0), unit_vectors(zeniths[1:], 180.0)])
        ticks = [
            np.outer([0.985, 1.015 + 0.015 * (t % 30 == 0)], unit_vectors(t, azimuth))
            for t in range(0, 90, 10)
            for azimuth in (0.0, 180.0)
        ]
        self._add(_lines([arc, *ticks]), "#9a9a9a", width=1.2)
        self._zenith_labels = [
            (t, self.letters.add(f"{t}°", 1.075 * unit_vectors(t, azimuth), GREY))
            for t in (0, 30, 60)
            for azimuth in ((0.0, 180.0) if t else (0.0,))
        ]
        self._angle_labels = [
            self.letters.add(text, (1.13 if azimuth else 1.11) * unit_vectors(90.0, azimuth), GREY, "below")
            for azimuth, text in ((0, "φ 0°"), (90, "φ 90°"), (180, "φ 180°"), (270, "φ 270°"))
        ]
        self._angle_labels += [
            self.letters.add(f"{t:g}°", np.sin(np.deg2rad(t)) * unit_vectors(90.0, 75.0), GREY, "below")
            for t in (30.0, 60.0)
        ]

    def show(self, angles: tuple[float, ...], scale: RadiusScale, signed: bool = False) -> None:
        """Draw the incident and mirror directions of one θi (degrees) or several, and the bar of a scale."""
        state = (angles, scale, signed)
        if state == self._drawn:
            return
        arrows, mirrors = [], []
        for theta_i in angles:
            source, mirror = unit_vectors(theta_i, [0.0, 180.0])
            arrows += [np.vstack([BEYOND * source, np.zeros(3)]), *_arrow_head(source)]
            mirrors.append(np.vstack([np.zeros(3), BEYOND * mirror]))
        self._incident.GetMapper().SetInputData(_lines(arrows))
        self._mirror.GetMapper().SetInputData(_lines(mirrors))
        source, mirror = unit_vectors(angles[0], [0.0, 180.0])
        self._place_words(angles[0], source, mirror)
        for t, label in self._zenith_labels:
            label.SetVisibility(self.labelled and all(abs(t - theta_i) > 12.0 for theta_i in angles))
        if not self._drawn or self._drawn[1:] != state[1:]:
            self._show_bar(scale, signed)
        self._drawn = state

    def _place_words(self, theta_i: float, source: Array, mirror: Array) -> None:
        """Put "incident" and "mirror" where they touch neither one another nor bar, arc and azimuths."""
        outward, up = BEYOND + 0.06, np.array([0.0, 0.0, 1.0])
        if theta_i < STEEP:  # side by side, on either side of the normal
            anchors, apart = ("right", "left"), np.array([0.05, 0.0, 0.0])
            places = outward * up - apart, outward * up + apart
        elif theta_i < SLANTING:
            anchors, places = ("centre", "centre"), (outward * source, outward * mirror)
        else:  # inside: beyond the lines stand the bar and the azimuths
            anchors = ("left", "centre")
            places = 0.98 * source + [0.05, 0.0, 0.06], 1.13 * mirror + [0.06, 0.0, 0.07]
        for label, anchor, place in zip(
            (self._incident_label, self._mirror_label), anchors, places, strict=True
        ):
            self.letters.anchor(label, anchor)
            self.letters.move(label, place)

    def resize(self, letter: int, labelled: bool) -> None:
        """Give labels another height, pixels; without room only those of the two directions are left."""
        self.letters.resize(letter)
        self.labelled = labelled
        for label in self._angle_labels:
            label.SetVisibility(labelled)
        self._drawn = ()

    def _show_bar(self, scale: RadiusScale, signed: bool) -> None:
        ticks = scale.ticks()
        up = np.array([0.0, 0.0, 1.0])
        bar = [np.vstack([BAR_PLACE, BAR_PLACE + up])]
        bar += [np.vstack([BAR_PLACE + r * up, BAR_PLACE + r * up - [BAR_TICK, 0.0, 0.0]]) for r, _ in ticks]
        self._bar.GetMapper().SetInputData(_lines(bar))
        name = f"difference, {scale.quantity}" if signed else scale.quantity
        texts = [(name, BAR_PLACE + 1.1 * up - [0.2, 0.0, 0.0], "left")]
        beside = np.array([2.0 * BAR_TICK, 0.0, 0.0])
        texts += [(text, BAR_PLACE + r * up - beside, "right") for r, text in ticks]
        # While a slider moves the bar changes with every step: labels are reused, not made anew.
        while len(self._bar_labels) < len(texts):
            anchor = texts[len(self._bar_labels)][2]
            self._bar_labels.append(self.letters.add("0", BAR_PLACE, BLACK, anchor))
        for label, (text, place, _) in zip(self._bar_labels, texts, strict=False):
            self.letters.write(label, text)
            self.letters.move(label, place)
        for k, label in enumerate(self._bar_labels):
            label.SetVisibility(k < len(texts))


def _arrow_head(source: Array) -> list[Array]:
    """Two strokes at the end of the incident line, in the plane of incidence."""
    across = np.array([source[2], 0.0, -source[0]])
    tip = 0.02 * source
    return [np.vstack([tip, tip + 0.09 * source + side * 0.04 * across]) for side in (-1.0, 1.0)]


def _lines(strokes: list[Array]) -> Any:
    """One polydata of several polylines, each (K, 3)."""
    import pyvista as pv

    cells, first = [], 0
    for stroke in strokes:
        cells += [len(stroke), *range(first, first + len(stroke))]
        first += len(stroke)
    return pv.PolyData(np.vstack(strokes), lines=cells)


def _empty() -> Any:
    import pyvista as pv

    return pv.PolyData()

"""From where a lobe is seen: a parallel view that keeps lengths comparable, and its mathematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# What must be inside the picture: half the width with the scale bar, and the height from rim to top.
HALF_WIDTH, HALF_HEIGHT = 1.5, 0.92


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes
    ----------
    azimuth : float
        Where the viewer stands, degrees, turned from the side of the plane of incidence (0) towards the
        mirror direction.
    elevation : float
        Degrees above the ground.
    centre : (float, float, float)
        World point in the middle of the picture.
    room : float
        How much larger than the lobe's surroundings the picture is.
    """

    azimuth: float = 16.0
    elevation: float = 24.0
    centre: tuple[float, float, float] = (-0.1, 0.0, 0.38)
    room: float = 1.0

    @property
    def axes(self) -> Array:
        """Right, up and towards the viewer, (3, 3), unit vectors in rows."""
        a, e = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
        right = np.array([np.cos(a), np.sin(a), 0.0])
        return np.array([right, np.cross(towards, right), towards])

    def half_height(self, width: int, height: int) -> float:
        """World length from the middle to the upper edge of a picture of a size in pixels."""
        return self.room * max(HALF_HEIGHT, HALF_WIDTH * height / width)

    def apply(self, camera: Any, width: int, height: int) -> None:
        """Set a VTK camera for a picture of a size in pixels."""
        right, up, towards = self.axes
        del right
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*self.centre)
        camera.SetPosition(*(np.array(self.centre) + 6.0 * towards))
        camera.SetViewUp(*up)
        camera.SetParallelScale(self.half_height(width, height))
        camera.SetClippingRange(1.0, 12.0)


def project(renderer: Any, points: npt.ArrayLike) -> Array:
    """Pixels (K, 2) from the lower left corner of the window of world points (K, 3) in a VTK renderer."""
    world = np.asarray(points, dtype=float).reshape(-1, 3)
    matrix = renderer.GetActiveCamera().GetCompositeProjectionTransformMatrix(
        renderer.GetTiledAspectRatio(), -1.0, 1.0
    )
    rows = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    clip = np.column_stack([world, np.ones(len(world))]) @ rows.T
    place = (clip[:, :2] / clip[:, 3:] + 1.0) / 2.0
    size, origin = np.array(renderer.GetSize()), np.array(renderer.GetOrigin())
    return np.asarray(origin + place * size)

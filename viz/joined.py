"""How directions that were measured are joined to a surface, or to a sheet in one plane."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def joined_directions(
    vectors: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Triangles (T, 3) and lines (L, 2) that join directions (K, 3); corner −1 is the origin.

    Directions all over the hemisphere are joined by a Delaunay triangulation of their projection on the
    ground; directions in one plane by a sheet from the origin, in the order of their angle.
    """
    none3, none2 = np.zeros((0, 3), dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    count = len(vectors)
    if count == 1:
        return none3, np.array([[-1, 0]], dtype=np.int64)
    spread = np.linalg.svd(vectors, compute_uv=False)
    if count < 4 or spread[-1] < 0.02 * np.sqrt(count):
        # In the plane that holds them, ordered from the source's side over the normal.
        _, _, axes = np.linalg.svd(vectors, full_matrices=False)
        angle = np.arctan2(vectors @ axes[1], vectors @ axes[0])
        order = np.argsort(np.mod(angle - _widest_gap(angle), 2.0 * np.pi))
        ends = np.stack([order[:-1], order[1:]], axis=-1)
        return np.insert(ends, 0, -1, axis=1), ends
    from scipy.spatial import Delaunay

    return np.asarray(Delaunay(vectors[:, :2]).simplices, dtype=np.int64), none2


def _widest_gap(angle: npt.NDArray[np.float64]) -> float:
    """Angle at the end of the widest empty sector: where a fan of directions begins."""
    ordered = np.sort(angle)
    gaps = np.diff(np.append(ordered, ordered[0] + 2.0 * np.pi))
    return float(ordered[(int(gaps.argmax()) + 1) % len(ordered)])

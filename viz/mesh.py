"""The mesh of a lobe: rings around the mirror direction, close together where the lobe is narrow.

A point is (ρ, ψ): ρ the angle from the mirror direction, ψ the sector around it, 0 towards larger zenith.
Rings lie at ρ_j = w sinh(t_j asinh(ρ_max(ψ) / w)), t_j = j / R: equally spaced within the width w of the
lobe, growing geometrically outside, and the last ring on the limiting zenith, because the cap θr ≤ limit
is convex and every great circle from the mirror direction leaves it once. So a 0.1° lobe costs a few more
rings, its tip is always a point of the mesh, and while a slider moves only points move: triangles stay.

Most BRDF models are even in φ. Of those only the half with sin φ ≤ 0 (y ≥ 0) is evaluated; the other half is
its mirror image. A model that tells incident azimuths apart is evaluated all around.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError

Single = npt.NDArray[np.float32]

DEFAULT_RINGS, DEFAULT_SECTORS = 96, 48
NET_RINGS, NET_SECTORS = 14, 16
"""Lines of the net that stands for a surface where several are laid over each other."""
WIDEST = np.deg2rad(20.0)
"""Lobes broader than this need no refinement around their middle."""


@dataclass(frozen=True)
class LobeMesh:
    """Connectivity and ring spacing of a lobe; the points follow from an incident zenith.

    Attributes
    ----------
    width : float
        Scale w of the rings, rad: about the half width of the lobe.
    limit : float
        Largest view zenith drawn, degrees, below 90.
    rings, sectors : int
        R rings and S sectors in half of the circle: (R + 1) · 2S points in all.
    even : bool
        Whether one half of the circle is the mirror image of the other.
    """

    width: float
    limit: float = 85.0
    rings: int = DEFAULT_RINGS
    sectors: int = DEFAULT_SECTORS
    even: bool = True

    def __post_init__(self) -> None:
        if not 0.0 < self.limit < 90.0:
            raise InputError(f"the limiting zenith is {self.limit:g}°; it lies between 0 and 90")
        if not 0.0 < self.width <= np.pi:
            raise InputError(f"the width of the lobe is {self.width:g} rad; it lies in (0, π]")

    @property
    def size(self) -> int:
        """Number of points of the whole mesh."""
        return (self.rings + 1) * 2 * self.sectors

    @property
    def shape(self) -> tuple[int, int]:
        """Rings and sectors that are evaluated; ring 0 is the mirror direction, repeated.

        (R + 1, S + 1) of half a circle, whose ends both count; (R + 1, 2S) of all of it.
        """
        return self.rings + 1, self.sectors + 1 if self.even else 2 * self.sectors

    @cached_property
    def triangles(self) -> npt.NDArray[np.int64]:
        """Corners of every triangle, (T, 3), outward side counted anticlockwise."""
        j, k = np.meshgrid(np.arange(self.rings), np.arange(2 * self.sectors), indexing="ij")
        across = 2 * self.sectors
        here, right = j * across + k, j * across + (k + 1) % across
        outer, outer_right = here + across, right + across
        first = np.stack([here, outer, outer_right], axis=-1)
        second = np.stack([here, outer_right, right], axis=-1)
        # Around the mirror direction the second triangle of each cell has no area.
        return np.concatenate([first.reshape(-1, 3), second[1:].reshape(-1, 3)])

    @cached_property
    def plane_curve(self) -> npt.NDArray[np.int64]:
        """Points of the plane of incidence, (2R + 1,), from the forward limit over the mirror direction."""
        rings = np.arange(self.rings + 1) * 2 * self.sectors
        return np.append(rings[::-1], rings[1:] + self.sectors)

    @cached_property
    def net(self) -> npt.NDArray[np.int64]:
        """Lines of a wide-meshed net over the whole surface, as cells of VTK: a count and its points."""
        across = 2 * self.sectors
        rings = np.unique(np.linspace(0, self.rings, NET_RINGS + 1).round().astype(np.int64))[1:]
        sectors = np.arange(0, across, max(1, across // NET_SECTORS))
        around = np.append(np.arange(across), 0)
        lines = [j * across + around for j in rings]
        lines += [np.arange(self.rings + 1) * across + k for k in sectors]
        return np.concatenate([np.insert(line, 0, len(line)) for line in lines])

    @cached_property
    def _circle(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        k = np.arange(self.shape[1])
        psi = np.pi * k / self.sectors
        return np.cos(psi), np.where(k % self.sectors == 0, 0.0, np.sin(psi))

    def views(self, theta_i: float) -> Single:
        """View vectors x, y, z and sin²γ of what is evaluated, (4, *shape), fp32.

        Computed in fp32 around the mirror direction: errors are relative to ρ, not to the zenith, so
        that lobes far narrower than 0.1° keep their shape.

        Raises
        ------
        InputError
            θi (degrees) is not in [0, limit].
        """
        if not 0.0 <= theta_i <= self.limit:
            raise InputError(
                f"incident zenith {theta_i:g}° cannot be drawn; the mesh ends at {self.limit:g}°"
            )
        mirror, edge = np.deg2rad(theta_i), np.deg2rad(self.limit)
        cos_psi, sin_psi = self._circle
        a, b = np.cos(mirror), -np.sin(mirror) * cos_psi
        farthest = np.arctan2(b, a) + np.arccos(np.minimum(np.cos(edge) / np.hypot(a, b), 1.0))
        stretch = np.arcsinh(np.maximum(farthest, 0.0) / self.width)
        t = np.arange(self.rings + 1, dtype=np.float32)[:, None] / np.float32(self.rings)
        grown = np.exp(t * stretch.astype(np.float32))
        half_angle = np.float32(0.25 * self.width) * (grown - 1.0 / grown)  # ρ/2, as sinh by exponentials
        sin_half, cos_half = np.sin(half_angle), np.cos(half_angle)
        sin2 = sin_half * sin_half
        sin_rho, cos_rho = 2.0 * sin_half * cos_half, 1.0 - 2.0 * sin2
        forward = sin_rho * cos_psi.astype(np.float32)
        cos_m, sin_m = np.float32(np.cos(mirror)), np.float32(np.sin(mirror))
        out = np.empty((4, *self.shape), dtype=np.float32)
        out[0] = cos_rho * sin_m + forward * cos_m
        out[1] = sin_rho * sin_psi.astype(np.float32)
        out[2] = np.maximum(cos_rho * cos_m - forward * sin_m, np.float32(1e-6))
        out[3] = sin2
        return out


def whole(half: Single, out: Single, odd: bool = False) -> None:
    """Write values of the half (R + 1, S + 1), or of all, to the whole mesh (R + 1, 2S); y is odd."""
    if half.shape == out.shape:
        out[:] = half
        return
    sectors = half.shape[1] - 1
    out[:, : sectors + 1] = half
    mirrored = half[:, sectors - 1 : 0 : -1]
    if odd:
        np.negative(mirrored, out=out[:, sectors + 1 :])
    else:
        out[:, sectors + 1 :] = mirrored

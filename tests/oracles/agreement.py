"""Directions in which oracles are asked, and how far apart two sets of values are."""

from __future__ import annotations

import numpy as np

from tests.reference.models.domain import HARD_DIRECTIONS

# theta_i, theta_r, phi in degrees, (N,) each.
Directions = tuple[np.ndarray, np.ndarray, np.ndarray]


def ordinary_directions(count: int, seed: int) -> Directions:
    """Spread over the hemisphere, to 80° from the normal and not within 2° of the hot spot."""
    rng = np.random.default_rng(seed)
    drawn = rng.uniform(0, 80, count), rng.uniform(0, 80, count), rng.uniform(0, 360, count)
    return tuple(angle[phase_angle(drawn) > 2.0] for angle in drawn)


def hard_directions(*, hot_spot: bool | None = None, without: str = "") -> Directions:
    """Give the named hard cases: all, those within 0.01° of the hot spot, or those which are not."""
    cases = np.array([angles for name, angles in HARD_DIRECTIONS.items() if name != without])
    theta_i, phi_i, theta_r, phi_r = cases.T
    directions = theta_i, theta_r, (phi_r - phi_i) % 360.0
    if hot_spot is None:
        return directions
    return tuple(angle[(phase_angle(directions) < 0.01) == hot_spot] for angle in directions)


def phase_angle(directions: Directions) -> np.ndarray:
    """Give the angle between the two directions in degrees."""
    theta_i, theta_r, phi = np.deg2rad(directions)
    across = np.sin(theta_i) * np.sin(theta_r)
    return np.rad2deg(
        2 * np.arcsin(np.sqrt(np.sin((theta_i - theta_r) / 2) ** 2 + across * np.sin(phi / 2) ** 2))
    )


def worst(values: np.ndarray, oracle: np.ndarray, scale: float = 1e-250) -> float:
    """Give the largest deviation relative to the oracle, or to `scale` where that is larger."""
    return float(np.max(np.abs(values - oracle) / np.maximum(np.abs(oracle), scale)))

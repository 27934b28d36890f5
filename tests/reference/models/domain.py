"""Points of a domain from a seed: parameters by the rows of a table, directions where models are hard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.reference.models.geometry import Angles

Point = tuple[dict[str, float], Angles]


@dataclass(frozen=True)
class Row:
    """A parameter: name, bounds, and the scale on which values spread, "lin" or "log".

    On a logarithmic scale magnitudes reach down to `floor` where a bound is 0.
    """

    name: str
    low: float
    high: float
    scale: str = "lin"
    floor: float | None = None

    def magnitudes(self) -> tuple[float, float]:
        """Give the ends of the logarithmic scale."""
        if self.low < 0 < self.high:
            raise ValueError(f"{self.name}: a logarithmic scale has one sign, not {self.low} to {self.high}")
        small, large = sorted((abs(self.low), abs(self.high)))
        small = max(small, self.floor or 0.0)
        if small == 0:
            raise ValueError(f"{self.name}: a logarithmic scale from 0 needs a floor")
        return small, large

    def middle(self) -> float:
        return float(self.spread(np.array([0.5]))[0])

    def spread(self, fractions: np.ndarray) -> np.ndarray:
        """Place fractions of the range, 0 to 1, on the scale."""
        if self.scale == "lin":
            return self.low + fractions * (self.high - self.low)
        if self.scale != "log":
            raise ValueError(f"{self.name}: the scale is lin or log, not {self.scale}")
        small, large = self.magnitudes()
        values = np.clip(small * (large / small) ** fractions, small, large)
        return values if self.high > 0 else -values


# One direction pair each: theta_i, phi_i, theta_r, phi_r in degrees.
HARD_DIRECTIONS: dict[str, Angles] = {
    "mirror": (30.0, 0.0, 30.0, 180.0),
    "mirror at 45": (45.0, 0.0, 45.0, 180.0),
    "mirror across the sample": (60.0, 90.0, 60.0, 270.0),
    "mirror at a turned sample": (60.0, 33.75, 60.0, 213.75),
    "mirror at 89.9": (89.9, 0.0, 89.9, 180.0),
    "mirror near the normal": (1e-6, 0.0, 1e-6, 180.0),
    "hot spot": (30.0, 0.0, 30.0, 0.0),
    "hot spot at 60": (60.0, 90.0, 60.0, 90.0),
    "hot spot at 89.9": (89.9, 0.0, 89.9, 0.0),
    "hot spot near the normal": (1e-6, 0.0, 1e-6, 0.0),
    "both normal": (0.0, 0.0, 0.0, 0.0),
    "both normal, azimuth 180": (0.0, 0.0, 0.0, 180.0),
    "normal incidence": (0.0, 0.0, 40.0, 180.0),
    "normal incidence, azimuth 90": (0.0, 0.0, 40.0, 90.0),
    "normal emergence": (40.0, 0.0, 0.0, 0.0),
    "normal to 89.9": (0.0, 0.0, 89.9, 180.0),
    "grazing incidence": (89.9, 0.0, 10.0, 180.0),
    "grazing emergence": (10.0, 0.0, 89.9, 90.0),
    "both grazing across": (89.9, 0.0, 89.9, 90.0),
    "both grazing, almost mirror": (89.9, 0.0, 89.8, 179.999),
    "azimuth 1e-6 off 180": (45.0, 0.0, 45.0, 180.0 - 1e-6),
    "azimuth 1e-6 past 180": (45.0, 0.0, 45.0, 180.0 + 1e-6),
    "azimuth 1e-6 off 0": (45.0, 0.0, 45.0, 1e-6),
    "azimuth 1e-6 before 360": (45.0, 0.0, 45.0, 360.0 - 1e-6),
    "zenith 1e-7 off the mirror": (45.0, 0.0, 45.0 + 1e-7, 180.0),
    "zenith 1e-7 off the hot spot": (45.0, 0.0, 45.0 + 1e-7, 0.0),
    "both 1e-7 off the mirror": (60.0, 0.0, 60.0 - 1e-7, 180.0 - 1e-7),
    "equal zenith across": (45.0, 0.0, 45.0, 90.0),
    "equal zenith across, turned": (45.0, 45.0, 45.0, 135.0),
    "in plane, off specular": (30.0, 0.0, 62.0, 180.0),
    "in plane, backward": (30.0, 0.0, 62.0, 0.0),
    "out of plane": (50.0, 20.0, 35.0, 155.0),
    "azimuth past a full turn": (50.0, 350.0, 35.0, 125.0),
    "Brewster's angle of n = 1.5": (56.309932474020215, 0.0, 56.309932474020215, 180.0),
}


def parameter_corners(rows: Sequence[Row]) -> list[dict[str, float]]:
    """Give the middle, all at one end, all at the other, and each row alone at either end."""
    middle = {row.name: row.middle() for row in rows}
    corners = [middle, {row.name: row.low for row in rows}, {row.name: row.high for row in rows}]
    for row in rows:
        corners += [{**middle, row.name: end} for end in (row.low, row.high)]
    return corners


def parameter_points(rows: Sequence[Row], count: int, seed: int) -> list[dict[str, float]]:
    """Give random parameters within their bounds; each stands at either end in one of thirty."""
    rng = np.random.default_rng(seed)
    columns = {}
    for row in rows:
        values = row.spread(rng.random(count))
        at_end = rng.random(count)
        columns[row.name] = np.where(at_end < 1 / 30, row.low, np.where(at_end > 29 / 30, row.high, values))
    return [{name: float(column[k]) for name, column in columns.items()} for k in range(count)]


def direction_points(count: int, seed: int, theta_max: float = 89.9, in_plane: bool = False) -> list[Angles]:
    """Give random directions, every second one where models are hard.

    Those are near the mirror direction and the hot spot (offsets from 10° down to 1e-9°, or exactly there),
    near the normal and near grazing, up to `theta_max`. `in_plane` leaves the azimuths 0 and 180° only.
    """
    rng = np.random.default_rng(seed)
    points = []
    for _ in range(count):
        theta_i, theta_r = (float(theta) for theta in rng.uniform(0.0, theta_max, 2))
        phi = float(rng.uniform(0.0, 360.0))
        kind = int(rng.integers(0, 12))
        if kind == 0:  # grazing
            theta_i = 90.0 - _offset(rng, 90.0 - theta_max, 10.0)
            theta_r = 90.0 - _offset(rng, 90.0 - theta_max, 10.0) if rng.random() < 0.5 else theta_r
        elif kind == 1:  # near the normal
            theta_i = _offset(rng, 1e-9, 1.0) if rng.random() < 0.8 else 0.0
            theta_r = _offset(rng, 1e-9, 1.0) if rng.random() < 0.5 else theta_r
        elif kind < 6:  # mirror direction or hot spot
            centre = 180.0 if kind % 2 else 0.0
            theta_r = theta_i + _signed(rng, rng.random() < 0.3)
            phi = centre + _signed(rng, rng.random() < 0.3)
        if in_plane:
            phi = 180.0 if 90.0 <= phi % 360.0 < 270.0 else 0.0
        theta_r = min(max(theta_r, 0.0), theta_max)
        if rng.random() < 0.5:
            theta_i, theta_r = theta_r, theta_i
        # On a grid of 2^-10 degrees, so that an exact mirror direction stays exact on a turned sample.
        phi_i = float(rng.integers(0, 360 * 1024)) / 1024 if rng.random() < 0.5 else 0.0
        points.append((theta_i, phi_i, theta_r, phi_i + phi))
    return points


def _offset(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _signed(rng: np.random.Generator, exact: bool) -> float:
    return 0.0 if exact else float(rng.choice([-1.0, 1.0])) * _offset(rng, 1e-9, 10.0)


def domain_points(rows: Sequence[Row], count: int, seed: int, theta_max: float = 89.9) -> list[Point]:
    """Give every corner of the parameters in every hard direction, then random points, `count` in all."""
    corners = parameter_corners(rows)
    hard = [(parameters, angles) for angles in HARD_DIRECTIONS.values() for parameters in corners]
    left = max(count - len(hard), 0)
    random = zip(parameter_points(rows, left, seed), direction_points(left, seed + 1, theta_max), strict=True)
    return [*hard, *random][:count]


_ALPHA = Row("alpha", 0.002, 1.5, "log")
_SCHLICK = (Row("F0", 0.0, 1.0), Row("F90", 0.0, 1.0))
_INDEX = Row("n", 1.1, 4.0)
_SCALE = Row("scale", 0.0, 1.0)
_METAL = (Row("n", 0.05, 4.0), Row("k", 0.0, 12.0))

# Where a model is used in practice; a package's own bounds may be others.
ROWS: dict[str, tuple[Row, ...]] = {
    "lambert": (Row("rho", 0.0, 1.2),),
    "minnaert": (Row("rho", 0.0, 1.5), Row("k", 0.3, 2.0)),
    "eon": (Row("rho", 0.0, 1.0), Row("r", 0.0, 1.0)),
    "oren_nayar": (Row("rho", 0.0, 1.0), Row("sigma", 0.0, 1.0)),
    "ggx": (_ALPHA, *_SCHLICK),
    "ggx_dielectric": (_ALPHA, _INDEX, _SCALE),
    "ggx_conductor": (_ALPHA, *_METAL, _SCALE),
    "ggx_anisotropic": (Row("alpha_x", 0.002, 1.5, "log"), Row("alpha_y", 0.002, 1.5, "log"), *_SCHLICK),
    "beckmann": (_ALPHA, *_SCHLICK),
    "beckmann_dielectric": (_ALPHA, _INDEX, _SCALE),
    "beckmann_conductor": (_ALPHA, *_METAL, _SCALE),
    "ward": (Row("rho_s", 0.0, 1.0), Row("alpha", 0.005, 0.5, "log")),
    "ward_anisotropic": (
        Row("rho_s", 0.0, 1.0),
        Row("alpha_x", 0.005, 0.5, "log"),
        Row("alpha_y", 0.005, 0.5, "log"),
    ),
    "abg": (Row("b0", 1e-6, 1e6, "log"), Row("x_k", 1e-4, 0.5, "log"), Row("g", 0.5, 3.5)),
    "kcorr": (Row("b0", 1e-6, 1e6, "log"), Row("l", 1e-4, 0.5, "log"), Row("C", 1.0, 5.0)),
    "rayleigh_rice": (Row("A", 1e-12, 1.0, "log"), Row("B", 0.1, 1e3, "log"), Row("C", 1.0, 5.0), *_METAL),
    "ross_li": (Row("f_iso", -1.0, 2.0), Row("f_vol", -1.0, 2.0), Row("f_geo", -1.0, 1.0)),
    "rpv": (Row("rho0", 0.0, 1.0), Row("k", 0.3, 1.5), Row("Theta", -0.6, 0.3), Row("rho_c", 0.0, 1.0)),
    "hapke": (
        Row("w", 0.001, 0.999),
        Row("b", 0.0, 0.95),
        Row("c", 0.0, 1.0),
        Row("theta_bar", 0.0, 45.0),
        Row("h", 0.005, 0.5),
        Row("B0", 0.0, 1.0),
    ),
    "wang2013": (
        Row("a", -20.0, 20.0),
        Row("b", -1.0, 2.0),
        Row("c", -1e6, 0.0, "log", 1e-9),
        Row("d", 0.2, 2.0),
        Row("ks", 0.0, 1e5, "log", 1e-12),
        Row("kd", 0.0, 10.0, "log", 1e-12),
    ),
}

"""One component of a scan's uncertainty: how large, and what its errors have in common.

The error of a component is u(n, λ) z(n, λ), z of variance 1 and with the correlation

    r = r_direction(n, n′) · r_incident_angle(θi, θi′) · r_wavelength(λ, λ′);

a product of correlations is one again (Schur). So an error of the lamp that is one for all values is
systematic in all three; one of the lamp's position, the same wherever the lamp stands still, is random over
incident angles and systematic else; counting noise is random over directions and wavelengths.

Source: JCGM 102:2011, 5 and 6; the names of the forms are those of the CoMET toolkit's obsarray.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.scan.correlation import Correlation, Places, bell, covariance_factor

Array = npt.NDArray[np.float64]

DIMENSIONS = ("direction", "incident_angle", "wavelength")

RANDOM = Correlation("random")
SYSTEMATIC = Correlation("systematic")

SAME_ANGLE = 1e-6
"""Incident zeniths that differ by less than this, degrees, are the same."""


@dataclass(frozen=True, eq=False)
class Component:
    """One component of the uncertainty of N × W values; immutable.

    Attributes
    ----------
    name : str
        What it comes from, such as "reference panel"; each name once in a scan.
    values : (N, W) float64
        Standard uncertainty: a fraction of the BRDF where `relative`, else 1/sr. A number, or a shape that
        broadcasts, stands for all. The sign counts where errors have something in common: a stage that stops
        a little off raises one flank of a lobe and lowers the other.
    relative : bool
    direction, incident_angle, wavelength : Correlation
        How the errors belong together along each dimension. Incident angles usually say nothing of their
        own: systematic.
    """

    name: str
    values: npt.ArrayLike
    relative: bool = True
    direction: Correlation = SYSTEMATIC
    incident_angle: Correlation = SYSTEMATIC
    wavelength: Correlation = SYSTEMATIC

    def __post_init__(self) -> None:
        if not self.name or not isinstance(self.name, str):
            raise InputError("a component of the uncertainty has no name; say what it comes from")
        if self.incident_angle.form in ("groups", "matrix"):
            raise InputError(
                f"component {self.name!r}: incident angles correlate random, systematic or bell; give"
                f" {self.incident_angle.form} over directions"
            )

    @property
    def is_random(self) -> bool:
        """Whether errors in different directions have nothing in common, at one wavelength."""
        return self.direction.form == "random"

    @property
    def is_noise(self) -> bool:
        """Whether no two errors have anything in common."""
        return self.is_random and self.wavelength.form == "random"

    def sized(self, shape: tuple[int, int]) -> Component:
        """Return the component for N directions × W wavelengths, its values broadcast and checked.

        Raises
        ------
        InputError
            Naming the component: values or correlations of another shape, values that are not finite.
        """
        given = np.asarray(self.values, dtype=np.float64)
        own = given.flags.writeable
        try:
            values = np.broadcast_to(given.copy() if own else given, shape)
        except ValueError:
            raise InputError(
                f"component {self.name!r} has values of shape {given.shape}; {shape[0]} directions ×"
                f" {shape[1]} wavelengths need {shape}, or one number"
            ) from None
        # One number for all is looked at once.
        bad = ~np.isfinite(given)
        if bad.any():
            place = tuple(int(k[0]) for k in np.nonzero(np.broadcast_to(bad, shape)))
            raise InputError(
                f"component {self.name!r} has the uncertainty {values[place]:g} at {list(place)}; give a"
                " number, 0 where it does not act"
            )
        for name, length in (("direction", shape[0]), ("wavelength", shape[1])):
            found = getattr(self, name).length
            if found is not None and found != length:
                raise InputError(
                    f"component {self.name!r}: its correlation over {name}s is for {found} places, and the"
                    f" scan has {length} {name}s"
                )
        return replace(self, values=values)

    def absolute(self, brdf: Array) -> Array:
        """Return the standard uncertainty (N, W), 1/sr, with its sign, of values `brdf` (N, W)."""
        values = np.asarray(self.values)
        return np.asarray(values * np.abs(brdf)) if self.relative else values

    def rows(self, index: Places) -> Component:
        """Return the component in some of the directions."""
        values = np.asarray(self.values)[index]
        return replace(self, values=values, direction=self.direction.take(index))

    def columns(self, index: Places) -> Component:
        """Return the component at some of the wavelengths."""
        values = np.asarray(self.values)[:, index]
        return replace(self, values=values, wavelength=self.wavelength.take(index))

    def direction_modes(self, angles: Mapping[str, Array]) -> Array:
        """Return F (N, M) with F Fᵀ the correlation over directions and incident angles together.

        `angles` holds theta_i, theta_r, phi_r of the N directions, degrees. Not for a random component.
        """
        if self.incident_angle.form == "systematic":
            return self.direction.modes(_unit_vectors(angles))
        theta_i = angles["theta_i"]
        if self.direction.form == "systematic":
            distinct, back = np.unique(np.round(theta_i / SAME_ANGLE), return_inverse=True)
            return self.incident_angle_modes(distinct * SAME_ANGLE)[back.ravel()]
        return covariance_factor(self.direction_coefficients(angles))

    def incident_angle_modes(self, theta_i: Array) -> Array:
        """Return a factor of the correlation among distinct incident zeniths (I,), degrees."""
        return (
            np.eye(len(theta_i))
            if self.incident_angle.form == "random"
            else self.incident_angle.modes(theta_i)
        )

    def direction_coefficients(self, angles: Mapping[str, Array]) -> Array:
        """Return the correlation coefficients (N, N) over directions and incident angles together."""
        out = self.direction.coefficients(_unit_vectors(angles))
        if self.incident_angle.form == "systematic":
            return out
        theta_i = angles["theta_i"]
        if self.incident_angle.form == "random":
            return np.asarray(out * (np.abs(theta_i[:, None] - theta_i[None, :]) < SAME_ANGLE))
        return np.asarray(out * bell(theta_i, self.incident_angle.width))

    def words(self) -> str:
        """Return how its errors belong together, in words."""
        if self.is_noise:
            return "noise: every value for itself"
        where = []
        forms = {
            "direction": self.direction,
            "incident angle": self.incident_angle,
            "wavelength": self.wavelength,
        }
        if self.is_random:
            forms.pop("incident angle")
        for name, one in forms.items():
            if one.form == "systematic":
                continue
            unit = "nm" if name == "wavelength" else "°"
            text = {
                "random": f"each {name} for itself",
                "bell": f"{name}s alike within {one.width:g} {unit}".replace(" °", "°"),
                "groups": f"{name}s alike in groups",
                "matrix": f"{name}s by a matrix",
            }[one.form]
            where.append(text)
        return ", ".join(where) or "one error for all values"


def checked_components(given: Sequence[Any], shape: tuple[int, int]) -> tuple[Component, ...]:
    """Return components for N × W values, each name once.

    Raises
    ------
    InputError
        As `Component.sized`, or a name that occurs twice.
    """
    out: list[Component] = []
    for one in given:
        if not isinstance(one, Component):
            raise InputError(f"components hold a {type(one).__name__}; give clbrdf.scan.Component")
        if one.name in [other.name for other in out]:
            raise InputError(f"two components are called {one.name!r}; give each a name of its own")
        out.append(one.sized(shape))
    return tuple(out)


def root_sum(components: Sequence[Component], brdf: Array) -> Array:
    """Return the root of the sum of squares (N, W), 1/sr, of several components of values `brdf`."""
    total = np.zeros(brdf.shape)
    for one in components:
        total += one.absolute(brdf) ** 2
    return np.sqrt(total, out=total)


def _unit_vectors(angles: Mapping[str, Array]) -> Array:
    """Return view directions as vectors (N, 3) of a length at which a degree of arc is 1."""
    theta, phi = np.deg2rad(angles["theta_r"]), np.deg2rad(angles["phi_r"])
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    return np.asarray(np.rad2deg(unit))


def random_part(components: Sequence[Component], brdf: Array, sigma: Array | None) -> Array | None:
    """Return the standard uncertainty (N, W), 1/sr, of what differs from direction to direction.

    Without components all of `sigma`; None where nothing is random. NaN where `sigma` is unknown.
    """
    if not components:
        return sigma
    random = [one for one in components if one.is_random]
    if not random:
        return None
    with np.errstate(invalid="ignore"):
        out = root_sum(random, brdf)
    if sigma is not None:
        out[np.isnan(sigma)] = np.nan
    return out

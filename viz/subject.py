"""What is shown: a scan, with its fit where there is one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.geometry import Directions
from clbrdf.models import NEEDS_PHI
from clbrdf.scan import Scan
from clbrdf.scan.select import has_near
from clbrdf.storage import hdf5
from clbrdf.viz.mesh import WIDEST

Array = npt.NDArray[np.float64]

SAME_ANGLE = 0.05
"""Degrees within which a measured incident angle belongs to the one shown."""

DEFAULT_LIMIT = 85.0
"""View zenith, degrees, where meshes end: the model grows without bound towards grazing."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A scan and perhaps its fit, under a name.

    Attributes
    ----------
    name : str
        For legends.
    scan : Scan
    fit : Fit or None
    source : str
        Name of the file, "" if there is none.
    """

    name: str
    scan: Scan
    fit: Fit | None = None
    source: str = ""

    @property
    def wavelength(self) -> Array:
        """(W,), nm; of bands, which have none, 1 to W."""
        if self.scan.bands:
            return np.arange(1.0, len(self.scan.bands) + 1.0)
        return self.scan.wavelength

    def label(self, column: int) -> str:
        """Return what a column is called: "550 nm", or the name of a band."""
        return self.scan.labels[column]

    def parameters(self, column: int) -> Array | None:
        """Parameters (P,) at one wavelength; None where nothing is fitted."""
        if self.fit is None:
            return None
        vector = np.asarray(self.fit.vector[column])
        return vector if np.isfinite(vector).all() else None

    @property
    def anisotropic(self) -> bool:
        """Whether the fitted model tells incident azimuths apart."""
        return self.fit is not None and bool(self.fit.model.flags & NEEDS_PHI)

    @cached_property
    def phi_i(self) -> float:
        """The incident azimuth with most directions, degrees: where an anisotropic model is shown."""
        azimuths, counts = np.unique(self.scan.phi_i, return_counts=True)
        return float(azimuths[counts.argmax()])

    def rows(self, theta_i: float) -> npt.NDArray[np.intp]:
        """Places of the directions measured at an incident zenith, degrees.

        Beside an anisotropic model, those at its incident azimuth only.
        """
        there = np.abs(self.scan.theta_i - theta_i) <= SAME_ANGLE
        if self.anisotropic:
            there &= self.scan.phi_i == self.phi_i
        return np.flatnonzero(there)

    def reach(self, theta_i: float) -> float:
        """Return the largest view zenith measured at an incident zenith, else anywhere; degrees."""
        rows = self.rows(theta_i)
        return float(self.scan.theta_r[rows if len(rows) else slice(None)].max())

    def directions(self, theta_i: npt.ArrayLike, theta_r: npt.ArrayLike, phi: npt.ArrayLike) -> Directions:
        """Return directions at the incident azimuth that is shown; all in degrees, φ = φr − φi."""
        turn = self.phi_i if self.anisotropic else 0.0
        return Directions(
            np.asarray(theta_i, np.float64),
            np.full(1, turn),
            np.asarray(theta_r, np.float64),
            np.asarray(phi, np.float64) + turn,
        )

    def model_values(self, column: int, directions: Directions) -> Array:
        """Fitted BRDF of directions (N,) at one wavelength, (N,), 1/sr."""
        assert self.fit is not None
        model = self.fit.model
        return np.ravel(model.brdf(self.fit.vector[column][None, :], model.features(directions)))

    @property
    def sees(self) -> bool:
        """Whether an instrument stands between the fitted surface and measured values."""
        return self.fit is not None and self.fit.through is not None

    def seen_values(self, column: int, rows: npt.NDArray[np.intp]) -> Array:
        """Fit as the detector sees it in rows (K,) of the scan at one wavelength, (K,), 1/sr.

        This is what compares with measured values; of a fit of points, the model there.
        """
        assert self.fit is not None
        if self.fit.through is None:
            return self.model_values(column, self.scan.directions[rows])
        return np.asarray(self._observed[rows, column])

    def seen_spectrum(self, row: int) -> Array:
        """Fit as the detector sees it in a row of the scan at all wavelengths, (W,), 1/sr."""
        assert self.fit is not None
        if self.fit.through is None:
            return np.asarray(self.fit.evaluate(self.scan.directions[np.array([row])])[0])
        return np.asarray(self._observed[row])

    @cached_property
    def _observed(self) -> Array:
        assert self.fit is not None
        return self.fit.observed()

    def column(self, wavelength: float) -> int:
        """Place of the measured wavelength nearest to one in nm."""
        return int(np.abs(self.wavelength - wavelength).argmin())

    def check_wavelength(self, wavelength: float) -> None:
        """Raise InputError where a wavelength in nm lies far from all measured ones."""
        if self.scan.bands:
            if wavelength not in self.wavelength:
                bands = ", ".join(f"{k} {name}" for k, name in enumerate(self.scan.bands, 1))
                raise InputError(f"{self.name} has no wavelengths; choose a band by its number: {bands}")
            return
        waves = self.wavelength
        if not has_near(self.scan, wavelength):
            there = f"{waves[0]:g}" if len(waves) == 1 else f"{waves[0]:g} to {waves[-1]:g}"
            raise InputError(f"{self.name} has no wavelength near {wavelength:g} nm; it has {there} nm")

    def check_incident(self, theta_i: float) -> None:
        """Raise InputError where nothing is measured at an incident zenith (degrees) and nothing fitted."""
        if self.fit is None and len(self.rows(theta_i)) == 0:
            there = ", ".join(f"{a:g}" for a in self.scan.incident_angles[:12])
            raise InputError(
                f"{self.name} was not measured at θi = {theta_i:g}° and is not fitted; measured are {there}°"
            )

    def default_incident(self) -> float:
        """Return the measured incident zenith nearest to 45° that has usable values, degrees."""
        usable = ~self.scan.mask.all(axis=1)
        angles = np.unique(self.scan.theta_i[usable]) if usable.any() else self.scan.incident_angles
        return float(angles[np.abs(angles - 45.0).argmin()])

    def default_wavelength(self) -> float:
        """Return the usable wavelength nearest to 550 nm: fitted if there is a fit, measured otherwise.

        Of bands, the middle one.
        """
        usable = ~self.scan.mask.all(axis=0)
        if self.fit is not None:
            usable |= np.isfinite(self.fit.vector).all(axis=1)
        candidates = np.flatnonzero(usable) if usable.any() else np.arange(len(self.wavelength))
        if self.scan.bands:
            return float(self.wavelength[candidates[len(candidates) // 2]])
        return float(self.wavelength[candidates[np.abs(self.wavelength[candidates] - 550.0).argmin()]])


def open_subject(path: str | Path) -> Subject:
    """Read a scan or a fit file; several scans in one are named as in ``file.h5::name``.

    Of a scan, what one lobe can show is taken: its directions of reflection, and of a sample that was turned
    the incident azimuth with most directions. The subject's name tells what was left out.

    Raises
    ------
    InputError
        The file is missing, damaged, holds neither, or every value in it is masked.
    """
    with hdf5.open_file(path) as file:
        content = hdf5.content_of(file)
    fit = Fit.open(path) if content == "fit" else None
    scan, said = (Scan.open(path), "") if fit is None else (fit.scan, "")
    if fit is None:
        scan, said = _one_lobe(scan)
    if scan.mask.all() and (fit is None or not np.isfinite(fit.vector).all(axis=1).any()):
        reasons = ", ".join(f"{name} {count}" for name, count in scan.flag_counts().items())
        raise InputError(f"{path}: nothing to show: all {scan.brdf.size} values are masked ({reasons})")
    return Subject((scan.sample or Path(path).stem) + said, scan, fit, Path(path).name)


def _one_lobe(scan: Scan) -> tuple[Scan, str]:
    """Return the part of a scan that one lobe shows, and what its name has to say of it."""
    part, said = scan.reflection(), []
    if len(part) < len(scan):
        said.append("reflection")
    if len(part.rotations()):
        azimuths, counts = np.unique(part.phi_i, return_counts=True)
        phi_i = azimuths[counts.argmax()]
        part = part.rows(part.phi_i == phi_i)
        said.append(f"φi = {phi_i:g}° of {len(azimuths)}")
    return part, f" ({'; '.join(said)})" if said else ""


def named_apart(subjects: Sequence[Subject]) -> list[Subject]:
    """Return the subjects with the name of their file, or a number, after names that occur twice."""
    names = [s.name for s in subjects]
    files = [s.source for s in subjects]
    out = []
    for k, subject in enumerate(subjects):
        name = subject.name
        if names.count(name) > 1:
            apart = subject.source if files.count(subject.source) == 1 else str(k + 1)
            name = f"{name} ({apart})"
        out.append(replace(subject, name=name))
    return out


def drawing_limit(subjects: Sequence[Subject], theta_i: npt.ArrayLike = ()) -> float:
    """View zenith (degrees) where meshes end: DEFAULT_LIMIT, or what the data and angles asked for need."""
    largest = max([float(max(s.scan.theta_i.max(), s.scan.theta_r.max())) for s in subjects])
    asked = float(np.asarray(theta_i, dtype=np.float64).max(initial=0.0))
    return float(min(max(DEFAULT_LIMIT, largest, asked + 0.5), 89.9))


def lobe_width(subject: Subject, theta_i: float) -> float:
    """Half width at half height of the narrowest fitted lobe at an incident zenith, rad.

    Sought in the plane of incidence from the mirror direction towards the normal, where the growth towards
    grazing does not disturb; WIDEST where there is no lobe.
    """
    if subject.fit is None:
        return float(WIDEST)
    rho = np.geomspace(1e-4, 60.0, 400)
    theta_r = theta_i - rho
    directions = subject.directions(
        np.array([theta_i]),
        np.append(np.abs(theta_r), theta_i),
        np.append(np.where(theta_r < 0, 0.0, 180.0), 180.0),
    )
    values = subject.fit.evaluate(directions)
    good = np.isfinite(values).all(axis=0)
    widths = [float(WIDEST)]
    for along, peak in zip(values[:-1, good].T, values[-1, good], strict=True):
        base = along.min()
        below = np.flatnonzero(along - base < 0.5 * (peak - base))
        if peak > 1.2 * base and len(below):
            widths.append(float(np.deg2rad(rho[below[0]])))
    return min(widths)

"""What the points so far say: a fit of the model, its uncertainty, and whether the model is right."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit import Fit, fit
from clbrdf.geometry import Directions, cos_deg
from clbrdf.models import Model
from clbrdf.rig.adaptive.light import NoiseModel
from clbrdf.rig.adaptive.observe import CalibratedPoint
from clbrdf.rig.adaptive.score import covariance
from clbrdf.rig.adaptive.settings import Adaptive
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

STEP = 0.01
"""Step for the slopes of the model, degrees."""


@dataclass(frozen=True, eq=False)
class ValidationMisfit:
    """How far the validation points lie from the fit.

    Attributes
    ----------
    points : int
    chi2 : float
        Mean square of the deviations in units of their uncertainty, that of the fit included; 1 for a model
        that is right.
    relative : float
        Root mean square of the relative deviations.
    """

    points: int
    chi2: float
    relative: float

    @property
    def is_wrong(self) -> bool:
        """Whether chance explains the misfit no longer: five standard deviations of χ² over the points."""
        return self.points > 0 and self.chi2 > 1.0 + 5.0 * float(np.sqrt(2.0 / self.points))


@dataclass(frozen=True, eq=False)
class Knowledge:
    """A fit with what it predicts.

    Attributes
    ----------
    model : Model
    free : list of int
        Places of the fitted parameters.
    wavelength : (W,) float64
        nm.
    vector : (W, P) float64
        All parameters.
    cov : (W, F, F) float64
        Covariance of the fitted ones, from the rig's own noise.
    light : NoiseModel
    misfit : ValidationMisfit
    """

    model: Model
    free: list[int]
    wavelength: Array
    vector: Array
    cov: Array
    light: NoiseModel
    misfit: ValidationMisfit

    def predict(self, directions: Directions) -> tuple[Array, Array, Array, Array]:
        """BRDF (W, N), derivatives (W, N, F), σ of one measurement (W, N) and exposure times (N,), s."""
        return _predict(self.model, self.free, self.vector, self.light, directions)

    def estimates(self) -> Array:
        """Return the fitted parameters (W, F)."""
        return self.vector[:, self.free]


def learn(
    settings: Adaptive,
    model: Model,
    seen: list[CalibratedPoint],
    kept: list[CalibratedPoint],
    light: NoiseModel,
) -> Knowledge | None:
    """Fit `seen` and look how `kept`, which the fit does not know, lies to it.

    Two fits: measured uncertainties weight the first; the second takes those that the first predicts,
    because a value that came out low by chance has a low uncertainty too and would pull.

    Returns
    -------
    Knowledge or None
        None where nothing can be fitted yet.
    """
    scan = scan_of(seen, light_wavelengths(seen, settings.wavelengths))
    try:
        first = _fit(settings, model, scan)
        keep = np.flatnonzero(np.isfinite(first.vector).all(axis=1))
        if not len(keep):
            return None
        scan, given = scan.columns(keep), first.given
        light = replace(light, rate=light.rate[keep], pixels=light.pixels[keep])
        free = [place for place, name in enumerate(model.names) if name not in given]
        _, _, sigma, _ = _predict(model, free, first.vector[keep], light, scan.directions)
        second = _fit(settings, model, replace(scan, sigma=sigma.T))
    except InputError:
        return None
    vector = np.where(np.isfinite(second.vector), second.vector, first.vector[keep])
    _, jacobian, sigma, _ = _predict(model, free, vector, light, scan.directions)
    cov = covariance(jacobian, np.where(scan.mask.T, np.inf, sigma))
    knowledge = Knowledge(
        model, free, scan.wavelength, vector, cov, light, ValidationMisfit(0, np.nan, np.nan)
    )
    return replace(knowledge, misfit=_misfit(knowledge, kept)) if kept else knowledge


def light_wavelengths(seen: list[CalibratedPoint], most: int) -> Array:
    """At most so many of the wavelengths, evenly spread, nm."""
    wavelength = seen[0].wavelength
    places = np.linspace(0, len(wavelength) - 1, min(most, len(wavelength))).round().astype(int)
    return np.asarray(wavelength[places])


def scan_of(seen: list[CalibratedPoint], wavelength: Array) -> Scan:
    """Return observations as a scan at some of their wavelengths, nm."""
    places = np.searchsorted(seen[0].wavelength, wavelength)
    theta_i, phi_i, theta_r, phi_r = np.array([one.angles for one in seen]).T
    return Scan(
        theta_i,
        phi_i,
        theta_r,
        phi_r,
        wavelength,
        np.array([one.brdf[places] for one in seen]),
        sigma=np.array([one.sigma[places] for one in seen]),
    )


def _fit(settings: Adaptive, model: Model, scan: Scan) -> Fit:
    return fit(scan, model=model, fix=dict(settings.fix), weights="sigma", seed=settings.seed)


def _predict(
    model: Model, free: list[int], vector: Array, light: NoiseModel, directions: Directions
) -> tuple[Array, Array, Array, Array]:
    full = vector[:, None, :]
    features = model.features(directions)
    brdf = np.asarray(model.brdf(full, features), dtype=np.float64)
    brdf = np.broadcast_to(brdf, (len(vector), len(directions)))
    jacobian = np.asarray(model.jacobian(full, features))
    jacobian = np.broadcast_to(jacobian, (*brdf.shape, vector.shape[1]))[..., free]
    sigma, seconds = light.predict(
        brdf, _slopes(model, vector, directions, light), cos_deg(directions.theta_r)
    )
    return brdf, jacobian, sigma, seconds


def _slopes(model: Model, vector: Array, directions: Directions, light: NoiseModel) -> Array:
    """Root sum square (W, N) of the derivatives by θi and θr, 1/sr per degree; 0 where nobody asks."""
    shape = (len(vector), len(directions))
    if not light.budget.points.angle:
        return np.zeros(shape)
    total = np.zeros(shape)
    for name in ("theta_i", "theta_r"):
        angle = getattr(directions, name)
        low, high = np.maximum(angle - STEP, 0.0), np.minimum(angle + STEP, 89.99)
        after, before = (
            model.brdf(vector[:, None, :], model.features(replace(directions, **{name: moved})))
            for moved in (high, low)
        )
        total += ((after - before) / (high - low)) ** 2
    return np.sqrt(total)


def _misfit(knowledge: Knowledge, kept: list[CalibratedPoint]) -> ValidationMisfit:
    scan = scan_of(kept, knowledge.wavelength)
    brdf, jacobian, sigma, _ = knowledge.predict(scan.directions)
    own = np.einsum("wnp,wpq,wnq->wn", jacobian, knowledge.cov, jacobian)
    good = ~scan.mask.T & (sigma > 0.0)
    if not good.any():
        return ValidationMisfit(0, np.nan, np.nan)
    off = np.where(good, scan.brdf.T - brdf, 0.0)
    chi2 = float((off**2 / (sigma**2 + own))[good].mean())
    relative = float(np.sqrt(((off / np.where(brdf == 0.0, 1.0, brdf)) ** 2)[good].mean()))
    return ValidationMisfit(int(good.any(axis=0).sum()), chi2, relative)

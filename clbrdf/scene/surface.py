"""What is lit: BRDF values in directions and at wavelengths, from a model, a fit or a scan."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.geometry import Directions
from clbrdf.models import Model, get_model, restrict
from clbrdf.opencl.device import Device, open_queue, usable_device
from clbrdf.opencl.precision import Precision, get_precision
from clbrdf.opencl.values import (
    Launcher,
    evaluate_directions,
    features_in_parts,
    mean_over,
    working_precision,
)
from clbrdf.scan import Scan
from clbrdf.scene.curve import Curve
from clbrdf.scene.scenefile import Scene, check_terms
from clbrdf.storage import hdf5

Array = npt.NDArray[np.float64]
Real = npt.NDArray[Any]


class Surface(Protocol):
    """BRDF of a surface, 1/sr."""

    def values(self, directions: Directions, wavelength: Array) -> Array:
        """Return f (N, W)."""

    def blocks(self, directions: Directions, wavelength: Array, rows: int) -> Iterator[tuple[slice, Real]]:
        """Give f of `rows` directions after another, (n, W), fp32 where the arithmetic has no more digits.

        The array is used again for the block after the next.
        """

    def mean(
        self,
        nodes: Directions,
        weights: Array | None,
        wavelength: Array,
        offsets: Array,
        shares: Array | None,
    ) -> Array:
        """Return means (N, W): over nodes (N K) with weights (N, K) and over λ + offsets (B,) with shares."""

    @property
    def bound(self) -> float:
        """Relative error of the arithmetic."""

    def finish(self) -> None:
        """Wait for what is computed ahead."""

    def diverges(self, wavelength: Array) -> bool:
        """Whether the integral over the whole hemisphere has no bound."""


@dataclass(frozen=True, eq=False)
class ModelSurface:
    """A model, perhaps without some of its terms, with parameters over wavelength.

    Attributes
    ----------
    model : Model
    curves : callable
        Wavelengths (W,) -> parameter values (W,) by name.
    precision : Precision
    device : Device
    """

    model: Model
    curves: Callable[[Array], dict[str, Array]]
    precision: Precision
    device: Device

    def parameters(self, wavelength: Array) -> Array:
        """Return parameters (..., P) at wavelengths (...)."""
        flat = np.ravel(wavelength)
        named = self.curves(flat)
        named |= {p.name: flat for p in self.model.parameters if p.given == "wavelength"}
        vector = self.model.vector(named)
        whole = np.broadcast_to(vector, (len(flat), vector.shape[-1]))
        return np.ascontiguousarray(whole).reshape(*np.shape(wavelength), -1)

    def values(self, directions: Directions, wavelength: Array) -> Array:
        """As `Surface`: the very launch of `clbrdf.evaluate`."""
        p = self.parameters(wavelength)
        return evaluate_directions(self.model, p, directions, self.precision, self.device)

    def blocks(self, directions: Directions, wavelength: Array, rows: int) -> Iterator[tuple[slice, Real]]:
        """As `Surface`; while one block is used the next is computed."""
        launcher = Launcher(self.model, self.parameters(wavelength), self.precision, self.device)
        size = min(rows, len(directions)), len(wavelength)
        spare = [np.empty(size, self.precision.dtype) for _ in range(2)]
        under_way = None
        for start in [*range(0, len(directions), rows), len(directions)]:
            following = None
            if start < len(directions):
                x = features_in_parts(self.model, directions[start : start + rows], self.precision)
                following = (start, launcher.begin(x))
            if under_way is not None:
                first, pending = under_way
                spare.reverse()
                values = spare[0][: len(pending.x)]
                launcher.finish(pending, values)
                yield slice(first, first + len(values)), values
            under_way = following

    def mean(
        self,
        nodes: Directions,
        weights: Array | None,
        wavelength: Array,
        offsets: Array,
        shares: Array | None,
    ) -> Array:
        """As `Surface`."""
        p = self.parameters(wavelength[:, None] + offsets)
        x = self.model.features(nodes)
        k = 1 if weights is None else weights.shape[1]
        x = x.reshape(len(nodes) // k, k, -1)
        return mean_over(self.model, p, x, weights, shares, self.precision, self.device)

    @property
    def bound(self) -> float:
        """As `Surface`."""
        return self.precision.bound

    def finish(self) -> None:
        """As `Surface`."""
        open_queue(self.device).finish()

    def diverges(self, wavelength: Array) -> bool:
        """As `Surface`."""
        return self.model.diverges(self.parameters(wavelength))


@dataclass(frozen=True, eq=False)
class ScanSurface:
    """A measured surface: the nearest measured direction, straight lines between wavelengths.

    Masked values are NaN.
    """

    scan: Scan
    nearest: Callable[[Directions], npt.NDArray[np.intp]]

    def values(self, directions: Directions, wavelength: Array) -> Array:
        """As `Surface`."""
        rows, places = np.unique(self.nearest(directions), return_inverse=True)
        return np.asarray(self._rows(rows, wavelength)[places])

    def blocks(self, directions: Directions, wavelength: Array, rows: int) -> Iterator[tuple[slice, Real]]:
        """As `Surface`."""
        for start in range(0, len(directions), rows):
            part = directions[start : start + rows]
            yield slice(start, start + len(part)), self.values(part, wavelength)

    def mean(
        self,
        nodes: Directions,
        weights: Array | None,
        wavelength: Array,
        offsets: Array,
        shares: Array | None,
    ) -> Array:
        """As `Surface`."""
        from scipy.sparse import csr_array

        bands = (wavelength[:, None] + offsets).ravel()
        rows, places = np.unique(self.nearest(nodes), return_inverse=True)
        seen = self._rows(rows, bands).reshape(len(rows), len(wavelength), len(offsets))
        values = seen[..., 0] if shares is None else seen @ shares
        if weights is None:
            return np.asarray(values[places])
        n, k = weights.shape
        # Nodes that meet the same measured direction add up.
        table = csr_array((weights.ravel(), (np.repeat(np.arange(n), k), places)), shape=(n, len(rows)))
        return np.asarray(table @ values)

    def _rows(self, rows: npt.NDArray[np.intp], wavelength: Array) -> Array:
        measured = np.where(self.scan.mask[rows], np.nan, self.scan.brdf[rows])
        return np.array([np.interp(wavelength, self.scan.wavelength, row) for row in measured])

    @property
    def bound(self) -> float:
        """As `Surface`."""
        return float(np.finfo(np.float64).eps)

    def finish(self) -> None:
        """As `Surface`."""

    def diverges(self, wavelength: Array) -> bool:
        """As `Surface`."""
        del wavelength
        return False


def nearest_direction(scan: Scan) -> Callable[[Directions], npt.NDArray[np.intp]]:
    """Return a function that finds the nearest measured direction, the first of repeated ones.

    Distances are those of (θi, θr cosφ, θr sinφ), degrees.
    """
    from scipy.spatial import cKDTree

    rows, first = np.unique(_places(scan.directions), axis=0, return_index=True)
    tree = cKDTree(rows)
    return lambda directions: np.asarray(first[tree.query(_places(directions))[1]], dtype=np.intp)


def _places(directions: Directions) -> Array:
    turn = np.deg2rad(directions.phi)
    return np.stack(
        [directions.theta_i, directions.theta_r * np.cos(turn), directions.theta_r * np.sin(turn)], axis=1
    )


def make_surface(scene: Scene, device: Device | None = None) -> Surface:
    """Return the surface of a scene.

    Raises
    ------
    InputError
        The surface's file is missing or damaged, or the scene's wavelengths lie beyond it.
    DeviceError
        A model needs an OpenCL device and there is none.
    """
    settings = scene.surface
    if settings.file:
        with hdf5.open_file(settings.file) as file:
            is_fit = hdf5.content_of(file) == "fit"
        if not is_fit:
            if settings.terms is not None:
                raise InputError(
                    f"surface.terms: {settings.file} holds a scan, which has no terms; leave it out"
                )
            scan = Scan.open(settings.file)
            _check_range(scene, scan.wavelength)
            return ScanSurface(scan, nearest_direction(scan))
        fit = Fit.open(settings.file)
        _check_range(scene, fit.wavelength)
        model, curves = fit.model, fit_curves(fit)
    else:
        model = get_model(settings.model)
        curves = model_curves(model.by_full_name(settings.parameters))
    if settings.terms is not None:
        known = tuple(term.name for term in model.terms)
        try:
            check_terms(settings.terms, known)
        except ValueError as error:
            raise InputError(f"surface.{error}") from error
        whole = model
        kept_terms = frozenset(settings.terms)
        if not any(term.name in kept_terms and not term.factor_of for term in whole.terms):
            raise InputError(f"surface.terms leaves nothing that reflects; keep one of {', '.join(known)}")
        model = restrict(whole, frozenset(known) - kept_terms)
        given = curves

        def kept(wavelength: Array) -> dict[str, Array]:
            return {name: values for name, values in given(wavelength).items() if name in model.names}

        curves = kept
    precision = working_precision(model, get_precision(scene.precision))
    surface = ModelSurface(model, curves, precision, usable_device(device))
    try:
        surface.parameters(np.array(scene.wavelength))
    except InputError as error:
        raise InputError(f"surface.parameters: {error}") from error
    return surface


def model_curves(parameters: dict[str, Curve]) -> Callable[[Array], dict[str, Array]]:
    """Return parameters over wavelength as a scene file gives them."""
    return lambda wavelength: {name: curve.at(wavelength) for name, curve in parameters.items()}


def fit_curves(fit: Fit) -> Callable[[Array], dict[str, Array]]:
    """Return the fitted parameters over wavelength, straight lines between those that were fitted."""
    good = np.isfinite(np.stack(list(fit.parameters.values()))).all(axis=0)
    if not good.any():
        raise InputError("surface.file: the fit has no wavelength with parameters")
    return lambda wavelength: {
        name: np.interp(wavelength, fit.wavelength[good], values[good])
        for name, values in fit.parameters.items()
    }


def _check_range(scene: Scene, measured: Array) -> None:
    first, last = scene.wavelength[0], scene.wavelength[-1]
    if first < measured[0] or last > measured[-1]:
        raise InputError(
            f"wavelength runs from {first:g} to {last:g} nm, and {scene.surface.file} from"
            f" {measured[0]:g} to {measured[-1]:g} nm; stay within it"
        )

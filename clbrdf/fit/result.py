"""What comes out of a fit: parameters at every wavelength, how good they are, and what made them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError
from clbrdf.fit import storage
from clbrdf.fit.carried import Mean, mean_of_parameter
from clbrdf.fit.frame import to_dataframe, to_xarray, write_csv
from clbrdf.fit.goodness import misfit
from clbrdf.fit.montecarlo import MonteCarlo
from clbrdf.fit.predict import standard_uncertainty
from clbrdf.fit.records import STATUSES, Estimate, Goodness, Search, Setup
from clbrdf.fit.remarks import Remarks, remarks_of
from clbrdf.fit.tables import report, summary_rows
from clbrdf.fit.through import Through
from clbrdf.geometry import Directions
from clbrdf.models import Model
from clbrdf.observation import ForwardModel, Observation
from clbrdf.records import Record, frozen_map, html_table
from clbrdf.scan import Scan
from clbrdf.storage import hdf5

if TYPE_CHECKING:
    import h5py
    import pandas as pd
    import xarray as xr

Array = npt.NDArray[np.float64]

__all__ = ["STATUSES", "Fit"]


@dataclass(frozen=True, eq=False)
class Fit(Record):
    """A model fitted to a scan at W wavelengths; immutable.

    Attributes
    ----------
    scan : Scan
        What was fitted.
    model : Model
    setup : Setup
        What was asked: weights, limits, fixed and shared parameters, method, seed.
    estimate : Estimate
        Parameters, their uncertainties and correlations as arrays.
    goodness : Goodness
        E of (13), σ_r of (14), χ²/ν, and what deviations along θr and from repeats say.
    search : Search
        How the parameters were found, and where.
    status : (W,) str
        One of STATUSES.
    through : Through or None
        The instrument that the fit looked through; None where directions were taken as points.
    provenance : mapping of str to str
        Program version, settings, hash of the input; for readers, nothing in the program reads it.
    monte_carlo : MonteCarlo or None
        Coverage intervals from draws, where they were asked for.
    """

    scan: Scan
    model: Model
    setup: Setup
    estimate: Estimate
    goodness: Goodness
    search: Search
    status: npt.NDArray[np.str_]
    through: Through | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    monte_carlo: MonteCarlo | None = None

    @property
    def wavelength(self) -> Array:
        """(W,), nm."""
        return self.scan.wavelength

    @cached_property
    def parameters(self) -> Mapping[str, Array]:
        """Best values (W,) by name, in the units of the model's table."""
        return self._named(self.estimate.vector)

    @cached_property
    def sigma(self) -> Mapping[str, Array]:
        """Standard uncertainties (W,) by name; NaN at a bound, infinite where the data cannot tell."""
        return self._named(self.estimate.sigma)

    @cached_property
    def intervals(self) -> Mapping[str, Array]:
        """Profile-likelihood intervals of 68.3 % (W, 2) by name; empty unless the fit was asked for them.

        An end that stands at a limit of the parameter is the limit itself.
        """
        lower, upper = self.estimate.lower, self.estimate.upper
        if lower is None or upper is None:
            return frozen_map({})
        ends = np.stack([lower, upper], axis=-1)
        return frozen_map({name: ends[:, j].copy() for j, name in enumerate(self.model.names)})

    def _named(self, values: Array) -> Mapping[str, Array]:
        return frozen_map({name: values[:, j].copy() for j, name in enumerate(self.model.names)})

    @property
    def vector(self) -> Array:
        """Parameters in table order, (W, P)."""
        return self.estimate.vector

    @property
    def correlation(self) -> Array:
        """Correlations of the uncertainties, (W, P, P); NaN where one of two parameters has none."""
        return self.estimate.correlation

    def budget(self, name: str) -> Mapping[str, Array]:
        """Return what makes the error bar of a parameter: 1σ (W,) by component.

        The squares add up to that of ``sigma[name]``, where it has one.

        Raises
        ------
        InputError
            The model has no such parameter.
        """
        place = self._place(name)
        parts = self.estimate.parts
        return frozen_map(
            {part.name: np.sqrt(np.maximum(part.covariance[:, place, place], 0.0)) for part in parts}
        )

    def mean(self, name: str, weights: npt.ArrayLike | None = None) -> Mean:
        """Return the mean of a parameter over wavelengths, its error bar with the correlations between them.

        Parameters
        ----------
        name : str
        weights : (W,) array, optional
            Not negative; the same for all wavelengths if not given. Wavelengths where the parameter has no
            uncertainty, at a bound or undetermined, are left out.

        Raises
        ------
        InputError
            The model has no such parameter; weights of another shape or sign.
        """
        place = self._place(name)
        w = len(self.wavelength)
        share = np.ones(w) if weights is None else np.asarray(weights, dtype=np.float64)
        if share.shape != (w,) or not (share >= 0.0).all():
            raise InputError(f"weights of a mean have shape {share.shape}; give {w} that are not negative")
        values, sigma = self.estimate.vector[:, place], self.estimate.sigma[:, place]
        return mean_of_parameter(self.estimate.parts, values, sigma, place, share)

    def _place(self, name: str) -> int:
        if name not in self.model.names:
            raise InputError(
                f"{self.model.name} has no parameter {name!r}; it has {', '.join(self.model.names)}"
            )
        return self.model.names.index(name)

    @property
    def objective(self) -> Array:
        """E of (13) with the weights used, (W,)."""
        return self.goodness.objective

    @property
    def relative_rms(self) -> Array:
        """σ_r of (14) over all directions, (W,)."""
        return self.goodness.relative_rms

    @property
    def given(self) -> tuple[str, ...]:
        """Parameters that were not fitted: fixed, or the wavelength itself."""
        return tuple(self.setup.fixed)

    @property
    def shared(self) -> tuple[str, ...]:
        """Parameters that are one number for all wavelengths."""
        return self.setup.shared

    @cached_property
    def remarks(self) -> tuple[Remarks, ...]:
        """For each wavelength what has to be known beside its parameters; empty where nothing."""
        return remarks_of(self)

    @property
    def chi2_reduced(self) -> Array:
        """χ²/ν with the scan's uncertainties, (W,); NaN where they are not known."""
        return self.goodness.chi2_reduced

    @property
    def misfit(self) -> npt.NDArray[np.bool_]:
        """Where the model does not describe the data, (W,): their uncertainties or repeats say so."""
        return misfit(self.goodness)

    @cached_property
    def residuals(self) -> Array:
        """Measured less fitted BRDF, (N, W), 1/sr; NaN where a value was not fitted."""
        return np.where(self.setup.weights > 0.0, self.scan.brdf - self.observed(), np.nan)

    def predict(
        self, directions: Scan | Directions | None = None, return_std: bool = False
    ) -> Array | tuple[Array, Array]:
        """Return the fitted BRDF, (N, W), 1/sr, in the scan's directions or others; NaN where not fitted.

        The surface's own, as `evaluate`. With `return_std` also its standard uncertainty, (N, W), from the
        uncertainties of the parameters and their correlations: parameters that are fixed, or at a limit,
        count as exact, and it is infinite where the data cannot tell a parameter that counts. That the model
        may not describe the data is not in it (`misfit`).

        Raises
        ------
        InputError
            Something else than directions, or a scan that has them.
        """
        where = _directions_of(self.scan if directions is None else directions)
        seen = ForwardModel(self.model, self.model.features(where))
        values: Array = seen.brdf(self.vector[:, None, :]).T
        return (values, standard_uncertainty(seen, self.estimate)) if return_std else values

    def to_dataframe(self) -> pd.DataFrame:
        """Return a table of pandas, one row a wavelength; needs the extra clbrdf[table]."""
        return to_dataframe(self)

    def to_xarray(self) -> xr.Dataset:
        """Return scan and fit as a dataset of xarray; needs the extra clbrdf[table]."""
        return to_xarray(self)

    def to_csv(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the columns of `to_dataframe` as CSV, whole or not at all.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        write_csv(self, path, overwrite)

    def __repr__(self) -> str:
        return f"<Fit of {self.model.name} to {self.scan.sample or 'a sample'}: {self._told()}>"

    def _told(self) -> str:
        w = len(self.wavelength)
        statuses = Counter(str(status) for status in self.status)
        counts = ", ".join(f"{count} {status}" for status, count in statuses.most_common())
        poor = int(self.misfit.sum())
        return f"{w} wavelength{'s' * (w != 1)}, {counts}{f', {poor} misfit' if poor else ''}"

    def _repr_html_(self) -> str:
        return html_table(f"Fit of {self.model.name}", dict(summary_rows(self)))

    def evaluate(self, directions: Scan | Directions | None = None) -> Array:
        """Fitted BRDF, (N, W), 1/sr, in the scan's directions or others; NaN where there is no fit.

        The surface's own: `observed` is what compares with measured values.

        Raises
        ------
        InputError
            Something else than directions, or a scan that has them.
        """
        x = self.model.features(_directions_of(self.scan if directions is None else directions))
        out: Array = self.model.brdf(self.vector[:, None, :], x).T
        return out

    @cached_property
    def observation(self) -> Observation:
        """What the detector sees in the scan's directions."""
        if self.through is None:
            return Observation.points(self.scan.directions)
        return self.through.observation(self.scan.directions)

    def observed(self) -> Array:
        """Fitted values as the detector sees them in the scan's directions, (N, W), 1/sr."""
        if self.through is None:
            return self.evaluate()
        return self._mixed(ForwardModel.of(self.model, self.observation))

    def predict_seen(self, where: Scan | Directions) -> Array:
        """Fitted values as the same instrument sees them in other directions, (N, W), 1/sr.

        Of a scan, with the aperture that it tells of, if this fit took that of its own.
        """
        if self.through is None:
            return self.evaluate(where)
        return self._mixed(self.forward(where))

    def forward(self, where: Scan | Directions) -> ForwardModel:
        """Return the model as the same instrument sees it in other directions, N.

        Its cones get as many nodes everywhere as they got where this fit needed most.
        """
        directions = _directions_of(where)
        if self.through is None:
            return ForwardModel(self.model, self.model.features(directions))
        return ForwardModel.of(self.model, self.through.elsewhere(where).observation(directions))

    def _mixed(self, seen: ForwardModel) -> Array:
        """Values (N, W), mixed over wavelengths where a slit does so."""
        assert self.through is not None
        out: Array = seen.brdf(self.vector[:, None, :]).T
        fitted = self.setup.fitted
        slit = self.through.slit(self.wavelength[fitted])
        if slit is not None:
            out[:, fitted] = out[:, fitted] @ slit.T
        return out

    def report(self, width: int = 100) -> str:
        """Return the fit as text of at most `width` characters: tables, how it went, and remarks.

        Values stand with their standard uncertainty in the last digits, 0.02562(13).
        """
        return report(self, width)

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the fit with its scan as a NeXus HDF5 file, whole or not at all.

        The same input, settings, seed and device give the same bytes.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        with self.creating(path, overwrite):
            pass

    @contextmanager
    def creating(self, path: str | Path, overwrite: bool = False) -> Iterator[h5py.Group]:
        """Write the fit as `save` does; more can be written into its entry while the block runs."""
        title = f"{self.model.title}, fitted to {self.scan.sample or 'a sample'}"
        with hdf5.create_file(path, "fit", title, overwrite) as file:
            entry = file["entry"]
            self.scan.write(entry)
            storage.write(self, hdf5.group(entry, "fit", "NXprocess"))
            yield entry

    @classmethod
    def open(cls, path: str | Path) -> Fit:
        """Read a fit file, of this version or an earlier one.

        Raises
        ------
        InputError
            The file is missing, damaged, of a newer version, or holds a scan only.
        """
        with hdf5.open_file(path) as file:
            hdf5.check_content(file, "fit")
            try:
                return cls(**storage.read(hdf5.find_entry(file, path)))
            except InputError as error:
                raise InputError(f"{path}: {error}") from error


def _directions_of(where: object) -> Directions:
    if isinstance(where, Scan):
        return where.directions
    if isinstance(where, Directions):
        return where
    raise InputError(
        f"directions are given as {type(where).__name__}; give a Scan, or"
        " Directions(theta_i, phi_i, theta_r, phi_r) in degrees"
    )

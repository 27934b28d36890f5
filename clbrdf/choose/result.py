"""What comes out of a choice: the models in order, what was chosen, and how each of them did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.choose import storage
from clbrdf.choose.candidates import Skipped
from clbrdf.choose.rule import one_standard_error
from clbrdf.errors import InputError
from clbrdf.fit.result import Fit
from clbrdf.geometry import read_only
from clbrdf.models import get_model
from clbrdf.observation import ForwardModel
from clbrdf.records import Record, frozen_map, html_table
from clbrdf.scan import Scan
from clbrdf.storage import hdf5

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ranked(Record):
    """One model of a ranking.

    Attributes
    ----------
    model : str
    free : int
        Parameters fitted at each wavelength.
    score : (I, W) float64
        At each incident angle, when it was left out: mean of N s² (f_predicted − f)², the square of a
        relative deviation (`clbrdf.choose.leave_out`).
    predicted : float
        √ of its mean: relative deviation of what was predicted.
    above, standard_error : float
        Mean of the scores less that of the best model, and the standard error of this paired difference over
        incident angles.
    within : bool
        Whether the difference is at most its standard error.
    relative_rms : float
        σ_r of (14) of the fit to all incident angles, median over wavelengths.
    aicc, bic, chi2_reduced : float
        `clbrdf.choose.criteria`; χ² is NaN unless the weights are the scan's uncertainties.
    lag_one : float
        Correlation of neighbouring residuals along θr.
    mean_residual : (I,) float64
        Relative, at each incident angle; positive where the model lies above the data.
    exchange : float
        Largest factor by which exchanging source and detector changes the fitted BRDF; 1 if reciprocal.
    reflectance : float
        Largest directional-hemispherical reflectance of the fitted BRDF; above 1 it makes energy.
    cut : float
        View zenith to which that integral runs, degrees; below 90 where it has no bound.
    parameters : mapping of str to (W,) float64
        Of the fit to all incident angles.
    milliseconds : float
        Of a fit, a wavelength. Not saved: a file holds only what input, settings and seed determine.
    """

    model: str
    free: int
    score: Array
    relative_rms: float
    aicc: float
    bic: float
    chi2_reduced: float
    lag_one: float
    mean_residual: Array
    exchange: float
    reflectance: float
    cut: float
    parameters: Mapping[str, Array]
    predicted: float = float("nan")
    above: float = float("nan")
    standard_error: float = float("nan")
    within: bool = False
    milliseconds: float = float("nan")

    def __post_init__(self) -> None:
        read_only(self.score)
        read_only(self.mean_residual)
        object.__setattr__(self, "parameters", frozen_map(self.parameters))


@dataclass(frozen=True, eq=False)
class Choice(Record):
    """Which model describes a scan; immutable.

    Attributes
    ----------
    ranking : tuple of Ranked
        The lowest score first. All were fitted with the same weights to the same values.
    chosen : str
        The simplest model within one paired standard error of the best.
    fit : Fit
        Of the chosen model to the whole scan.
    theta_i : (I,) float64
        Incident zeniths that were left out in turn, degrees.
    places : (W,) int
        Wavelengths of the scan that the ranking is made at.
    skipped : tuple of Skipped
        Models that were not compared, and why.
    thin : tuple of str
        Wavelengths that the ranking leaves out: too few values there for some of the models.
    verdict : str
        In words: "" where nothing speaks against the chosen model, else why no model fits.
    misfit : tuple of str
        Where the chosen model misses the data most: which angles, which sign, what size.
    """

    ranking: tuple[Ranked, ...]
    chosen: str
    fit: Fit
    theta_i: Array
    places: npt.NDArray[np.intp]
    skipped: tuple[Skipped, ...] = ()
    thin: tuple[str, ...] = ()
    verdict: str = ""
    misfit: tuple[str, ...] = ()
    weights: str = field(default="")

    def __post_init__(self) -> None:
        for name in ("ranking", "skipped", "thin", "misfit"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        read_only(self.theta_i)
        read_only(self.places)

    def __repr__(self) -> str:
        verdict = "" if self.fits else ", and no model fits"
        sample = self.fit.scan.sample or "a sample"
        return f"<Choice of {self.chosen} among {len(self.ranking)} models for {sample}{verdict}>"

    def _repr_html_(self) -> str:
        rows = {
            f"{row.model}{' (chosen)' if row.model == self.chosen else ''}": f"{100 * row.predicted:.3g} %"
            for row in self.ranking
        }
        return html_table("deviation of what was predicted, by model", rows)

    @property
    def fits(self) -> bool:
        """Whether the best model meets the data within their uncertainties, as far as these are known."""
        return not self.verdict

    @property
    def steady(self) -> tuple[str, ...]:
        """What the rule would choose, from the same fits, without the evidence of each incident angle."""
        scores, free = np.stack([row.score for row in self.ranking]), [row.free for row in self.ranking]
        without = (np.delete(scores, k, axis=1) for k in range(scores.shape[1]))
        return tuple(self.ranking[one_standard_error(some, free).chosen].model for some in without)

    @property
    def best(self) -> Ranked:
        """The model of the lowest score."""
        return self.ranking[0]

    def of(self, model: str) -> Ranked:
        """Return a model's place in the ranking.

        Raises
        ------
        InputError
            It was not compared.
        """
        for row in self.ranking:
            if row.model == model:
                return row
        known = ", ".join(row.model for row in self.ranking)
        raise InputError(f"model {model!r} is not in the ranking; it holds {known}")

    @property
    def scan(self) -> Scan:
        """The scan at the wavelengths of the ranking, without directions of transmission."""
        return self.fit.scan.columns(self.places)

    def values(self, model: str) -> Array:
        """Return what the detector sees by a model's fit, (N, W) of the scan and the ranking, 1/sr.

        With the nodes that the chosen model needs.
        """
        row, made = self.of(model), get_model(model, force=True)
        vector = np.stack([row.parameters[name] for name in made.names], axis=-1)
        out: Array = ForwardModel.of(made, self.fit.observation).brdf(vector[:, None, :]).T
        return out

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write the fit of the chosen model, with the ranking in it, as a NeXus HDF5 file.

        `Fit.open` reads the fit, `Choice.open` all of it.

        Raises
        ------
        InputError
            The file exists and `overwrite` is False, or it cannot be written.
        """
        with self.fit.creating(path, overwrite) as entry:
            storage.write(self, hdf5.group(entry, storage.GROUP, "NXprocess"))

    @classmethod
    def open(cls, path: str | Path) -> Choice:
        """Read a file that `save` wrote.

        Raises
        ------
        InputError
            The file is missing or damaged, or its fit was not chosen among models.
        """
        fit = Fit.open(path)
        with hdf5.open_file(path) as file:
            entry = hdf5.find_entry(file, path)
            if storage.GROUP not in entry:
                raise InputError(f"{path}: holds a fit and no ranking of models; 'clbrdf choose' makes one")
            try:
                return storage.read(cls, Ranked, fit, entry[storage.GROUP])
            except InputError as error:
                raise InputError(f"{path}: {error}") from error

    @classmethod
    def is_in(cls, path: str | Path) -> bool:
        """Whether a file holds a fit with a ranking."""
        with hdf5.open_file(path) as file:
            return hdf5.content_of(file) == "fit" and storage.GROUP in hdf5.find_entry(file, path)

"""One model among those compared: its fit, what it predicts, and what its residuals look like."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf.choose.angles import AngleGroups
from clbrdf.choose.candidates import Candidate
from clbrdf.choose.criteria import Criteria, criteria
from clbrdf.choose.leave_out import leave_out
from clbrdf.choose.residuals import lag_one_correlation, mean_residuals
from clbrdf.choose.result import Ranked
from clbrdf.choose.surface import behaviour
from clbrdf.fit import Fit, fit
from clbrdf.fit.through import SCAN
from clbrdf.instrument.settings import Instrument
from clbrdf.opencl.device import Device
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Work:
    """What is the same for all models: the data, g of (13), and how fits are made.

    Attributes
    ----------
    scan : Scan
        N directions × W wavelengths of the ranking.
    groups : AngleGroups
    weights : (N, W) float64
        g of (13).
    named : str or (N,) array
        The weights as `fit` takes them.
    method : str
    seed : int
    device : Device
    through : str, Path or Instrument
        As `fit` takes it.
    """

    scan: Scan
    groups: AngleGroups
    weights: Array
    named: str | npt.ArrayLike
    method: str
    seed: int
    device: Device
    through: str | Path | Instrument = SCAN

    @property
    def sigma_known(self) -> bool:
        """Whether g = 1/σ²."""
        return isinstance(self.named, str) and self.named == "sigma"

    def fit(self, candidate: Candidate, scan: Scan, rows: npt.NDArray[np.intp]) -> Fit:
        """Fit a model to the scan in some of its directions, each with its own weight."""
        return fit(
            scan,
            model=candidate.model,
            weights=self.named if isinstance(self.named, str) else np.asarray(self.named)[rows],
            fix=candidate.fix,
            method=self.method,
            seed=self.seed,
            through=self.through,
            device=self.device,
        )


def rank_one(work: Work, candidate: Candidate) -> tuple[Ranked, Criteria]:
    """Return what a model did; its standing beside the others is left open."""
    scan, g = work.scan, work.weights
    whole = work.fit(candidate, scan, np.arange(len(scan)))
    left = leave_out(scan, g, work.groups, partial(work.fit, candidate))
    values = whole.observed()
    residual = np.where(g > 0.0, np.sqrt(g) * (values - scan.brdf), np.nan)
    used = (g > 0.0).sum(axis=0)
    figures = criteria(np.nansum(residual**2, axis=0), used, candidate.free, work.sigma_known)
    surface = behaviour(whole)
    row = Ranked(
        model=candidate.model.name,
        free=candidate.free,
        score=left.score,
        relative_rms=float(np.nanmedian(whole.relative_rms)),
        aicc=figures.aicc,
        bic=figures.bic,
        chi2_reduced=figures.chi2_reduced,
        lag_one=lag_one_correlation(scan, residual),
        mean_residual=mean_residuals(scan, g, values, work.groups),
        exchange=surface.exchange,
        reflectance=surface.reflectance,
        cut=surface.cut,
        parameters=whole.parameters,
        milliseconds=float(np.nanmedian(left.milliseconds)),
    )
    return row, figures

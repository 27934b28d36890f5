"""What has to be known beside the parameters of a fit, as data: `words.py` makes sentences of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.fit.goodness import EXACT, misfit, neighbour_correlation, neighbours_agree, overstated
from clbrdf.fit.lines import view_lines
from clbrdf.models import NEEDS_PHI, Model
from clbrdf.observation import ForwardModel
from clbrdf.scan.rectangle import group_numbers

if TYPE_CHECKING:
    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NO_LOBE = 1e-6
"""Share of the BRDF below which the specular part counts as none."""

MUCH = 0.25
"""Share of E from which the change with the incident azimuth is a reason for it."""

STRONG = 0.999
"""Correlation from which two parameters are named."""

KINDS = (
    "misfit",
    "other weights",
    "lack of fit",
    "azimuth",
    "neighbours",
    "overstated",
    "no lobe",
    "few values",
    "few angles",
    "undetermined",
    "at bound",
    "correlated",
    "without sigma",
    "sigma of 0",
    "not positive",
)
"""What a remark may say, and its `numbers`:

misfit
    the model does not describe the data within their uncertainties: (χ²/ν, ν)
other weights
    the fit does not describe the data within their uncertainties, which its weights do not use: (χ²/ν, ν)
lack of fit
    the model misses repeated directions by more than they scatter: (F, degrees of freedom of the repeats)
azimuth
    the data change with the incident azimuth where the model cannot: (relative root mean square of the
    change, its share of E)
neighbours
    deviations of neighbours along θr go together: (their correlation,)
overstated
    deviations are smaller than the scan's uncertainties: (χ²/ν, ν)

no lobe
    the data show no specular part: its parameters are not determined
few values
    fewer values than parameters: (values, parameters)
few angles
    too few incident angles: (measured, needed)
undetermined
    the data cannot tell the parameters apart
at bound
    the parameter stands at its limit: (limit,)
correlated
    the data hardly tell the two parameters apart: (correlation,)
without sigma, sigma of 0, not positive
    values that are not masked, and have no weight because their standard uncertainty is unknown or 0, or
    because they are at or below 0: (values,)
"""


@dataclass(frozen=True)
class Remark:
    """One remark on a wavelength.

    Attributes
    ----------
    kind : str
        One of KINDS.
    parameters : tuple of str
        Those that it is about.
    numbers : tuple of float
        As KINDS says.
    """

    kind: str
    parameters: tuple[str, ...] = ()
    numbers: tuple[float, ...] = ()


Remarks = tuple[Remark, ...]


def remarks_of(fit: Fit) -> tuple[Remarks, ...]:
    """Return the remarks on each of the W wavelengths of a fit."""
    model, estimate, used = fit.model, fit.estimate, fit.setup.weights > 0.0
    seen = ForwardModel.of(model, fit.observation)
    free = len(model.names) - len(fit.setup.fixed)
    about_goodness, about_values = _about_goodness(fit), _about_values(fit)

    def found(k: int) -> Remarks:
        return (*about_goodness[k], *_about_parameters(k), *about_values[k])

    def _about_parameters(k: int) -> Remarks:
        vector, at_bound = estimate.vector[k], estimate.at_bound[k]
        if _no_lobe(seen, used[:, k], vector):
            lobe = _lobe_names(model)
            kept = np.array([name not in lobe for name in model.names])
            return (Remark("no lobe", tuple(lobe)), *_held(model, vector, at_bound & kept))
        theta_i = fit.scan.theta_i[used[:, k]]
        at_limit = [name for name, held in zip(model.names, at_bound, strict=True) if held]
        return (
            *_undetermined(model, theta_i, estimate.undetermined[k], at_limit, free),
            *_held(model, vector, at_bound),
            *_correlated(model, estimate.correlation[k]),
        )

    return tuple(found(k) for k in range(len(estimate.vector)))


def _about_goodness(fit: Fit) -> list[list[Remark]]:
    """Whether the model describes the data, for each wavelength."""
    found = fit.goodness
    poor, small, smooth = misfit(found), overstated(found), neighbours_agree(found.lag_score)
    turned = azimuth_dependence(fit)
    out: list[list[Remark]] = [[] for _ in poor]
    for k, here in enumerate(out):
        chi2, ratio = float(found.chi2_reduced[k]), float(found.lack_of_fit[k])
        degrees, repeats = float(found.degrees[k]), float(found.repeats[k])
        if poor[k] and chi2 > 1.0:
            kind = "misfit" if fit.setup.weighting == "sigma" else "other weights"
            here.append(Remark(kind, (), (chi2, degrees)))
        if poor[k] and ratio > 1.0:
            here.append(Remark("lack of fit", (), (ratio, repeats)))
        if np.isfinite(turned[0, k]):
            here.append(Remark("azimuth", (), (float(turned[0, k]), float(turned[1, k]))))
        if smooth[k]:
            here.append(Remark("neighbours", (), (float(found.lag_one[k]),)))
        if small[k] and not fit.scan.common_components:
            here.append(Remark("overstated", (), (chi2, degrees)))
    return out


def azimuth_dependence(fit: Fit) -> Array:
    """Return how the data change with the incident azimuth where the model cannot, (2, W); NaN where not.

    Of directions that differ in φi alone, the first row is the relative root mean square of the deviations
    from their mean, the second its share of E. The share has to be large, and those deviations must go
    together along θr, as noise does not.
    """
    scan, g = fit.scan, fit.setup.weights
    out = np.full((2, g.shape[1]), np.nan)
    if fit.model.flags & NEEDS_PHI or not len(scan.rotations()):
        return out
    group = group_numbers(np.stack([scan.theta_i, scan.theta_r, scan.phi], axis=1))
    used = g > 0.0
    measured = np.where(used, scan.brdf, 0.0)
    total = np.zeros((2, int(group.max()) + 1, g.shape[1]))
    np.add.at(total[0], group, g)
    np.add.at(total[1], group, g * measured)
    mean = total[1] / np.where(total[0] > 0.0, total[0], 1.0)
    deviation = np.where(used, measured - mean[group], 0.0)
    turned = (g * deviation**2).sum(axis=0)
    norm = (g * measured**2).sum(axis=0)
    told = (norm > 0.0) & (fit.objective > EXACT)
    share = turned / np.where(told, norm * fit.objective, np.inf)
    z = np.sqrt(g / g.max(initial=1e-300)) * deviation
    _, score = neighbour_correlation(view_lines(scan.directions), z.T, used.T)
    found = told & (share > MUCH) & neighbours_agree(score)
    out[:, found] = np.sqrt(turned[found] / norm[found]), np.minimum(share[found], 1.0)
    return out


def _about_values(fit: Fit) -> list[list[Remark]]:
    """Values that are not masked and yet have no weight, for each wavelength."""
    scan, weighting = fit.scan, fit.setup.weighting
    left = ~scan.mask & (fit.setup.weights == 0.0)
    reasons: dict[str, Mask] = {}
    if weighting == "sigma" and scan.sigma is not None:
        reasons = {"without sigma": left & np.isnan(scan.sigma), "sigma of 0": left & (scan.sigma == 0.0)}
    elif weighting == "relative":
        reasons = {"not positive": left & (scan.brdf <= 0.0)}
    counts = {kind: here.sum(axis=0) for kind, here in reasons.items()}
    return [
        [Remark(kind, (), (float(count[k]),)) for kind, count in counts.items() if count[k]]
        for k in range(left.shape[1])
    ]


def _lobe_names(model: Model) -> list[str]:
    assert model.structure is not None
    return [*model.structure.growth, *model.structure.shape, model.structure.linear[0]]


def _no_lobe(seen: ForwardModel, used: Mask, parameters: Array) -> bool:
    """Whether a model that tells its lobe from the rest has none in some directions."""
    model, structure = seen.model, seen.model.structure
    if structure is None or used.sum() < len(model.names) or not np.isfinite(parameters).all():
        return False
    rest = parameters[model.places(structure.linear)[1]] * structure.diffuse
    fitted = seen.take(used).brdf(parameters[None, :])
    return bool((fitted - rest).max() <= NO_LOBE * fitted.max())


def _undetermined(
    model: Model, theta_i: Array, undetermined: Mask, at_limit: list[str], free: int
) -> list[Remark]:
    """Which parameters the data cannot tell, and the reason where the model's structure gives one."""
    names = tuple(name for name, unknown in zip(model.names, undetermined, strict=True) if unknown)
    structure = model.structure
    if structure is not None and not names:
        # A valley that the data leave open may end at a limit, where what remains is determined.
        amplitude = {*structure.growth, structure.linear[0]}
        seen, held = len(np.unique(theta_i)), amplitude & set(at_limit)
        if held and seen < len(amplitude) <= free:
            names = tuple(name for name in model.names if name in amplitude)
            return [Remark("few angles", names, (seen, len(amplitude)))]
    if not names:
        return []
    if len(theta_i) < free:
        return [Remark("few values", names, (len(theta_i), free))]
    if structure is not None:
        amplitude = {*structure.growth, structure.linear[0]}
        seen = len(np.unique(theta_i))
        if set(names) <= amplitude and seen < len(amplitude):
            return [Remark("few angles", names, (seen, len(amplitude)))]
    return [Remark("undetermined", names)]


def _held(model: Model, parameters: Array, at_bound: Mask) -> list[Remark]:
    return [
        Remark("at bound", (name,), (float(value),))
        for name, value, bound in zip(model.names, parameters, at_bound, strict=True)
        if bound
    ]


def _correlated(model: Model, correlation: Array) -> list[Remark]:
    """Pairs of parameters that the data hardly tell apart."""
    rows, columns = np.nonzero(np.triu(np.abs(np.nan_to_num(correlation)) > STRONG, k=1))
    return [
        Remark("correlated", (model.names[i], model.names[j]), (float(correlation[i, j]),))
        for i, j in zip(rows, columns, strict=True)
    ]

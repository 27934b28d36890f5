"""What has to be known beside the parameters of a fit, as data: `words.py` makes sentences of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clbrdf.models import Model
from clbrdf.observation import ForwardModel

if TYPE_CHECKING:
    from clbrdf.fit.result import Fit

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NO_LOBE = 1e-6
"""Share of the BRDF below which the specular part counts as none."""

STRONG = 0.999
"""Correlation from which two parameters are named."""

KINDS = ("no lobe", "few values", "few angles", "undetermined", "at bound", "correlated")
"""What a remark may say, and its `numbers`:

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
    seen = ForwardModel(model, model.features(fit.scan.directions))
    free = len(model.names) - len(fit.setup.fixed)

    def found(k: int) -> Remarks:
        vector, at_bound = estimate.vector[k], estimate.at_bound[k]
        if _no_lobe(seen, used[:, k], vector):
            lobe = _lobe_names(model)
            kept = np.array([name not in lobe for name in model.names])
            return (Remark("no lobe", tuple(lobe)), *_held(model, vector, at_bound & kept))
        theta_i = fit.scan.theta_i[used[:, k]]
        return (
            *_undetermined(model, theta_i, estimate.undetermined[k], free),
            *_held(model, vector, at_bound),
            *_correlated(model, estimate.correlation[k]),
        )

    return tuple(found(k) for k in range(len(estimate.vector)))


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


def _undetermined(model: Model, theta_i: Array, undetermined: Mask, free: int) -> list[Remark]:
    """Which parameters the data cannot tell, and the reason where the model's structure gives one."""
    names = tuple(name for name, unknown in zip(model.names, undetermined, strict=True) if unknown)
    if not names:
        return []
    if len(theta_i) < free:
        return [Remark("few values", names, (len(theta_i), free))]
    structure = model.structure
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

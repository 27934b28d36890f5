"""AICc, BIC and reduced chi-squared of a fit, summed over wavelengths, each of which is fitted for itself.

With uncertainties known, χ² = Σ g r² with g = 1/σ²:

    AICc = Σ_λ χ² + 2p + 2p(p+1)/(N−p−1),    BIC = Σ_λ χ² + p ln N

Without them the scale of the deviations is one more parameter, q = p + 1:

    AICc = Σ_λ N ln(Σ g r²/N) + 2q + 2q(q+1)/(N−q−1),    BIC = Σ_λ N ln(Σ g r²/N) + q ln N

Only differences between models of the same data and weights mean anything. Both take deviations for
independent noise, which smooth systematic errors are not: then they favour too many parameters.
Sources: Hurvich and Tsai, Biometrika 76 (1989), doi:10.1093/biomet/76.2.297; Schwarz, Ann. Statist. 6 (1978),
doi:10.1214/aos/1176344136; Burnham and Anderson, Model Selection and Multimodel Inference (2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SMALLEST = 1e-300
"""Stands for a sum of squares of 0, whose logarithm has no bound."""


@dataclass(frozen=True)
class Criteria:
    """Of one model.

    Attributes
    ----------
    aicc, bic : float
        Infinite where there are too few values for AICc.
    chi2_reduced : float
        χ² over its degrees of freedom, all wavelengths together; NaN where uncertainties are not known.
    degrees : int
        Values less parameters, all wavelengths together.
    """

    aicc: float
    bic: float
    chi2_reduced: float
    degrees: int


def criteria(squares: Array, values: npt.NDArray[np.int64], free: int, sigma_known: bool) -> Criteria:
    """Return the criteria of a fit.

    Parameters
    ----------
    squares : (W,) float64
        Σ g r² at each wavelength.
    values : (W,) int
        N, those with g > 0; wavelengths without any are left out.
    free : int
        Parameters fitted at a wavelength.
    sigma_known : bool
        Whether g = 1/σ².
    """
    measured = values > 0
    s, n = squares[measured], values[measured].astype(np.float64)
    q = free if sigma_known else free + 1
    misfit = s if sigma_known else n * np.log(np.maximum(s, SMALLEST) / n)
    spare = n - q - 1.0
    with np.errstate(divide="ignore"):
        correction = np.where(spare > 0.0, 2.0 * q * (q + 1.0) / np.where(spare > 0.0, spare, 1.0), np.inf)
    degrees = int(n.sum()) - free * len(n)
    chi2 = float(s.sum() / degrees) if sigma_known and degrees > 0 else float("nan")
    return Criteria(
        aicc=float((misfit + 2.0 * q + correction).sum()),
        bic=float((misfit + q * np.log(n)).sum()),
        chi2_reduced=chi2,
        degrees=degrees,
    )

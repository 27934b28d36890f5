"""What of a model a fit can solve without searching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Structure:
    """How a model splits, for fits that need not search all of it.

        f = linear₀ · exp(log_growth) · lobe + linear₁ · diffuse

    with lobes that depend on the shape and the geometry alone and a growth that depends on the incident
    direction alone.

    Attributes
    ----------
    shape, growth : (str, str)
        Names of the parameters that enter the lobe and the growth.
    linear : (str, str)
        Names of the two linear parameters, both on a log scale and not negative: of the lobe, of the rest.
    diffuse : float
        BRDF of the rest for a parameter of 1, 1/sr.
    lobes : callable
        Shapes (K, 2), features (N, F) -> (K, N), 1/sr.
    shape_grid : callable
        Features (N, F), bounds (2, 2) -> shapes (K, 2) worth telling apart, their places (K, 2) in a grid.
    log_growth : callable
        Growths (..., 2), incident features (I, .) -> (..., I).
    growths : callable
        Logarithms of amplitudes (..., I), weights (..., I), incident features (I, .), bounds (2, 2) ->
        growths (..., V, 2) that come near to them.
    growth_grid : callable
        Bounds (2, 2) -> growths (G, 2) that cover them.
    """

    shape: tuple[str, str]
    growth: tuple[str, str]
    linear: tuple[str, str]
    diffuse: float
    lobes: Callable[[Array, Array], Array]
    shape_grid: Callable[[Array, Array], tuple[Array, npt.NDArray[np.intp]]]
    log_growth: Callable[[Array, Array], Array]
    growths: Callable[[Array, Array, Array, Array], Array]
    growth_grid: Callable[[Array], Array]

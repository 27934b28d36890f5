"""What a reference is, and derivatives of any reference by differences in high precision."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from mpmath import fabs, mpf, workdps

from tests.reference.models.geometry import Angles, Geometry, geometry

Parameters = Mapping[str, float]
Formula = Callable[[Geometry, Mapping[str, mpf], mpf | None], mpf]

# Published forms lose half of the digits where acos meets 1 and where a small difference is taken to a power
# of one half, so that 150 leave more than 60.
DIGITS = 150

# A central difference is off by step² and by 10^-75 / step, relative to the scale on which the value changes.
STEP = mpf(10) ** -30


@dataclass(frozen=True)
class Reference:
    """A model as its source prints it.

    Parameters
    ----------
    parameters
        Names, all of which `value` must be given.
    formula
        From geometry, parameters and the wavelength in nm to the BRDF in 1/sr.
    edges
        Ends of a parameter's range past which the formula is not defined or not smooth; None for no end.
    digits
        Working precision, decimal.
    """

    parameters: tuple[str, ...]
    formula: Formula
    edges: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    digits: int = DIGITS
    needs_wavelength: bool = False

    def value(
        self,
        parameters: Parameters,
        theta_i: float,
        phi_i: float,
        theta_r: float,
        phi_r: float,
        wavelength: float | None = None,
    ) -> mpf:
        """Give the BRDF in 1/sr, without the cosine; angles in degrees, the wavelength in nm."""
        with workdps(self.digits):
            return self._value(self._checked(parameters), (theta_i, phi_i, theta_r, phi_r), wavelength)

    def gradient(
        self, parameters: Parameters, angles: Angles, wavelength: float | None = None
    ) -> dict[str, mpf]:
        """Give the derivative of the BRDF by each parameter, one-sided at an edge."""
        with workdps(self.digits):
            point = self._checked(parameters)
            return {name: self._derivative(name, point, angles, wavelength) for name in self.parameters}

    def _checked(self, parameters: Parameters) -> dict[str, mpf]:
        if set(parameters) != set(self.parameters):
            raise ValueError(f"parameters are {', '.join(self.parameters)}; given: {', '.join(parameters)}")
        return {name: mpf(parameters[name]) for name in self.parameters}

    def _value(self, point: Mapping[str, mpf], angles: Angles, wavelength: float | None) -> mpf:
        if self.needs_wavelength and wavelength is None:
            raise ValueError("this model needs the wavelength")
        return self.formula(geometry(angles), point, None if wavelength is None else mpf(wavelength))

    def _derivative(self, name: str, point: dict[str, mpf], angles: Angles, wavelength: float | None) -> mpf:
        here = point[name]
        step = STEP * (fabs(here) if here else 1)
        low, high = self.edges.get(name, (None, None))

        def at(offset: int) -> mpf:
            return self._value({**point, name: here + offset * step}, angles, wavelength)

        if low is not None and here - step < low:
            return (-3 * at(0) + 4 * at(1) - at(2)) / (2 * step)
        if high is not None and here + step > high:
            return (3 * at(0) - 4 * at(-1) + at(-2)) / (2 * step)
        return (at(1) - at(-1)) / (2 * step)

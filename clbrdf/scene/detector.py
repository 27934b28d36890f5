"""From a BRDF to counts of the spectrometer, where an effect asks for counts.

    counts = t · R(λ) · f_r · Ω · cosθr,     R(λ) the counts per second of the direct beam

R is the spectrum of the lamp (Planck, photons) times the responsivity of a silicon array. With the
integration time "auto" each direction is exposed until its brightest wavelength fills `fill` of the range,
within limits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clbrdf.geometry import cos_deg
from clbrdf.storage.tomlfile import TomlTable

Array = npt.NDArray[np.float64]

SECOND_RADIATION = 1.438777e7
"""hc/k, nm K."""


class Detector(TomlTable):
    """The spectrometer; the defaults are those of the rig's sample file and of an STS spectrometer.

    Attributes
    ----------
    integration_time : "auto" or float
        s.
    shortest_time, longest_time : float
        Limits of "auto", s.
    fill : float
        Share of the range above the bias that "auto" aims at.
    direct_rate : float
        Counts per second of the brightest wavelength in the direct beam.
    lamp_temperature : float
        Of the lamp as a black body, K.
    solid_angle : float or None
        Ω of the receiver, sr; not given, that of the effect `aperture`, or 0.001.
    full_scale, bias : float
        Largest raw count; counts without light at zero time.
    electrons_per_count : float
    """

    integration_time: Literal["auto"] | Annotated[float, Field(gt=0.0, le=1000.0)] = "auto"
    shortest_time: Annotated[float, Field(gt=0.0)] = 10e-6
    longest_time: Annotated[float, Field(gt=0.0)] = 2.0
    fill: Annotated[float, Field(gt=0.0, le=10.0)] = 0.8
    direct_rate: Annotated[float, Field(gt=0.0)] = 1.0e8
    lamp_temperature: Annotated[float, Field(ge=1000.0, le=20000.0)] = 5500.0
    solid_angle: Annotated[float, Field(gt=0.0, le=6.0)] | None = None
    full_scale: Annotated[float, Field(gt=0.0)] = 16383.0
    bias: Annotated[float, Field(ge=0.0)] = 1500.0
    electrons_per_count: Annotated[float, Field(gt=0.0)] = 2.0

    @model_validator(mode="after")
    def _check(self) -> Detector:
        if self.bias >= self.full_scale:
            raise ValueError(f"bias {self.bias:g} leaves no room below full_scale {self.full_scale:g}")
        if self.longest_time < self.shortest_time:
            raise ValueError(
                f"longest_time {self.longest_time:g} s is below shortest_time {self.shortest_time:g} s"
            )
        return self


@dataclass(frozen=True, eq=False)
class ExposedDirections:
    """How n directions were exposed.

    Attributes
    ----------
    seconds : (n, 1) float64
    scale : (n, W) float64
        Counts for 1/sr.
    """

    seconds: Array
    scale: Array


def lamp_spectrum(wavelength: Array, temperature: float) -> Array:
    """Lamp (Planck, photons) times a silicon detector's responsivity, (W,), 1 at the brightest wavelength."""
    planck = wavelength**-4.0 / np.expm1(SECOND_RADIATION / (wavelength * temperature))
    responsivity = np.exp(-(((wavelength - 600.0) / 250.0) ** 2))
    product = planck * responsivity
    return np.asarray(product / product.max())


def expose(
    detector: Detector, solid_angle: float, wavelength: Array, theta_r: Array, values: Array
) -> ExposedDirections:
    """Return how directions with zeniths theta_r (n,) and BRDF values (n, W) are exposed."""
    spectrum = detector.direct_rate * lamp_spectrum(wavelength, detector.lamp_temperature)
    rate = spectrum * (solid_angle * cos_deg(theta_r))[:, None]
    if detector.integration_time == "auto":
        brightest = np.nanmax(values * rate, axis=1, initial=1e-300)
        seconds = detector.fill * (detector.full_scale - detector.bias) / brightest
        seconds = np.clip(seconds, detector.shortest_time, detector.longest_time)[:, None]
    else:
        seconds = np.full((len(theta_r), 1), detector.integration_time)
    return ExposedDirections(seconds, rate * seconds)

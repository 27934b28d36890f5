"""What the spectrometer sees: lamp, surface, geometry, dark level, and the effects that are switched on.

    counts = bias + dark rate · t + x(t · R(λ) · f_r · Ω · cosθr)

with R(λ) the counts per second of the direct beam (lamp spectrum times responsivity) and x the detector's
nonlinearity. Quantised to whole counts and cut at full scale. An effect that is not asked for is not
computed.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg
from clbrdf.models import get_model
from clbrdf.rig.drivers.obp import ObpSpectrometer
from clbrdf.rig.emulator.settings import EmulatorSettings, Spectral
from clbrdf.rig.kinematics import forward
from clbrdf.rig.rigfile import Rig
from clbrdf.scan import Scan

Array = npt.NDArray[np.float64]

WAVELENGTH_COEFFICIENTS = (340.0, 0.47, -2.0e-5, -1.0e-9)
"""Pixel number to nm: 340 to 799 nm over 1024 pixels."""

DIRECT_TOLERANCE = 0.5
"""The lamp counts as shining straight into the detector within this many degrees."""

SECOND_RADIATION = 1.438777e7
"""hc/k, nm K."""


class Clock:
    """The rig's time in s since it was switched on; runs `factor` times faster than ours."""

    def __init__(self, factor: float) -> None:
        self.factor = factor
        self._start = time.monotonic()

    def now(self) -> float:
        """Seconds since the start."""
        return (time.monotonic() - self._start) * self.factor

    def sleep(self, seconds: float) -> None:
        """Let time of the rig pass."""
        time.sleep(seconds / self.factor)


class World:
    """Everything outside the instruments; asked from several threads.

    Attributes
    ----------
    axes : callable
        Gives the true rig angles (lamp, turn, pitch), degrees.
    lamp_factor : float
        Share of its power that the lamp gives, changed by faults.
    """

    def __init__(self, rig: Rig, settings: EmulatorSettings, clock: Clock) -> None:
        self.rig = rig
        self.settings = settings
        self.clock = clock
        self.axes: Callable[[], tuple[float, ...]] = lambda: (0.0, 0.0, 0.0)
        self.lamp_factor = 1.0
        self._lock = threading.Lock()
        self._random = np.random.default_rng([settings.seed, 77])
        pixel = np.arange(ObpSpectrometer.pixels, dtype=np.float64)
        coefficients = np.array(WAVELENGTH_COEFFICIENTS, dtype="<f4").astype(np.float64)
        self.wavelength: Array = np.asarray(np.polynomial.polynomial.polyval(pixel, coefficients))
        self._direct = settings.direct_rate * _spectrum_of(self.wavelength, settings.lamp_temperature)
        self._surface = _surface(settings, self.wavelength)
        self._seen: tuple[tuple[float, ...], Array] | None = None

    def lamp(self) -> float:
        """Lamp power relative to its nominal one."""
        drift = self.settings.effects.lamp_drift
        hours = self.clock.now() / 3600.0 if drift else 0.0
        return self.lamp_factor * (1.0 + drift * hours)

    def reference_reading(self) -> float:
        """One reading of the reference detector, W."""
        power = self.settings.reference_power * self.lamp()
        noise = self.settings.effects.reference_noise
        if noise:
            with self._lock:
                power *= 1.0 + noise * self._random.standard_normal()
        return power

    def rate(self) -> Array:
        """Return the counts per second and pixel that the open shutter lets through, before any effect."""
        axes = self.axes()
        if self._seen is None or self._seen[0] != axes:
            self._seen = (axes, self._direct * self._share(axes))
        return self._seen[1]

    def _share(self, axes: tuple[float, ...]) -> Array | float:
        """Share of the incident power that reaches the detector: 1 in the direct beam, else f Ω cosθr."""
        lamp, turn, pitch = axes
        pose = forward(np.array([axes]))
        theta_i, theta_r = float(pose.theta_i[0]), float(pose.theta_r[0])
        if abs(abs(lamp) - 180.0) < DIRECT_TOLERANCE and abs(np.cos(np.deg2rad(turn))) < 0.01:
            return 1.0
        del pitch
        if theta_i >= 90.0 or theta_r >= 90.0 or abs(lamp) < self.rig.geometry.lamp_shadow / 2.0:
            return 0.0
        directions = Directions(pose.theta_i, pose.theta_r, pose.phi_r - pose.phi_i)
        return self._surface(directions) * self.rig.geometry.solid_angle * float(cos_deg(theta_r))

    def counts(self, seconds: float, is_open: bool) -> npt.NDArray[np.uint16]:
        """Raw counts (1024,) of an exposure."""
        effects = self.settings.effects
        dark = self.settings.dark_rate * seconds
        if effects.dark_drift:
            dark *= 1.0 + effects.dark_drift * self.clock.now() / 3600.0
        signal = self.rate() * (seconds * self.lamp()) if is_open else np.zeros(len(self.wavelength))
        if effects.stray_light:
            signal = signal + effects.stray_light * signal.mean()
        with self._lock:
            if effects.shot_noise:
                gain = self.rig.spectrometer.electrons_per_count
                charge = np.minimum((signal + dark) * gain, 1e9)
                signal = self._random.poisson(charge) / gain - dark
            if effects.read_noise:
                signal = signal + effects.read_noise * self._random.standard_normal(len(signal))
        if effects.nonlinearity:
            signal = _nonlinear(signal, effects.nonlinearity)
        total = np.rint(self.rig.spectrometer.bias + dark + signal)
        return np.clip(total, 0, ObpSpectrometer.full_scale).astype(np.uint16)


def _spectrum_of(wavelength: Array, temperature: float) -> Array:
    """Lamp (Planck, photons) times a silicon detector's responsivity, 1 at the brightest pixel."""
    planck = wavelength**-4.0 / np.expm1(SECOND_RADIATION / (wavelength * temperature))
    responsivity = np.exp(-(((wavelength - 600.0) / 250.0) ** 2))
    product = planck * responsivity
    return np.asarray(product / product.max())


def _nonlinear(net: Array, coefficients: tuple[float, ...]) -> Array:
    """Return counts x with x / p(x) = net: what the detector shows. Fixed-point iteration, p is near 1."""
    shown = net.copy()
    limited = ObpSpectrometer.full_scale
    for _ in range(60):
        shown = net * np.polynomial.polynomial.polyval(np.clip(shown, 0.0, limited), coefficients)
    return shown


def _surface(settings: EmulatorSettings, wavelength: Array) -> Callable[[Directions], Array]:
    """Return f_r (P,) in 1/sr of one direction, at every pixel."""
    if settings.scan:
        return _scan_surface(Scan.open(settings.scan), wavelength)
    return _model_surface(settings.model, settings.parameters, wavelength)


def _model_surface(
    name: str, parameters: Mapping[str, Spectral], wavelength: Array
) -> Callable[[Directions], Array]:
    model = get_model(name)
    values = {}
    for key, value in parameters.items():
        if isinstance(value, list):
            places, heights = zip(*value, strict=True)
            values[key] = np.interp(wavelength, places, heights)
        else:
            values[key] = np.asarray(value)
    vector = np.atleast_2d(model.vector(values))[:, None, :]

    def brdf(directions: Directions) -> Array:
        return np.broadcast_to(model.brdf(vector, model.features(directions))[:, 0], wavelength.shape)

    return brdf


def _scan_surface(scan: Scan, wavelength: Array) -> Callable[[Directions], Array]:
    """Return the nearest measured direction, straight lines between wavelengths; masked values count as 0."""
    values = np.where(scan.mask, 0.0, scan.brdf)

    def brdf(directions: Directions) -> Array:
        turn = np.deg2rad(scan.phi - directions.phi[0])
        distance = (
            (scan.theta_i - directions.theta_i[0]) ** 2
            + (scan.theta_r - directions.theta_r[0]) ** 2
            + 2.0 * scan.theta_r * directions.theta_r[0] * (1.0 - np.cos(turn))
        )
        return np.asarray(np.interp(wavelength, scan.wavelength, values[int(np.argmin(distance))]))

    return brdf

"""What the spectrometer sees: lamp, surface, geometry, dark level, and the effects that are switched on.

    counts = bias + dark rate · t + x(t · R(λ) · f_r · Ω · cosθr)

with R(λ) the counts per second of the direct beam (lamp spectrum times responsivity) and x the detector's
nonlinearity. Quantised to whole counts and cut at full scale. An effect that is not asked for is not
computed.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions, cos_deg
from clbrdf.models import get_model
from clbrdf.rig.emulator.settings import EmulatorSettings
from clbrdf.rig.kinematics import forward
from clbrdf.rig.rigfile import Rig
from clbrdf.scan import Scan
from clbrdf.scene.detector import lamp_spectrum
from clbrdf.scene.effects.dark import dark_counts
from clbrdf.scene.effects.lamp_drift import drift_factor
from clbrdf.scene.effects.nonlinearity import shown_counts
from clbrdf.scene.effects.read_noise import with_read_noise
from clbrdf.scene.effects.shot_noise import with_shot_noise
from clbrdf.scene.effects.stray_light import with_stray_light
from clbrdf.scene.surface import model_curves, nearest_direction

Array = npt.NDArray[np.float64]

WAVELENGTH_COEFFICIENTS = (340.0, 0.47, -2.0e-5, -1.0e-9)
"""Pixel number to nm: 340 to 799 nm over 1024 pixels."""

PIXELS, FULL_SCALE = 1024, 16383
"""Of an STS."""

RIM = 2.0
"""The rim shadows the sample this far beyond the rig file's largest zenith, degrees."""

EDGE_ON = 0.06
"""The sample lets the direct beam pass while the cosine of its turn is smaller than this."""

DIRECT_TOLERANCE = 0.5
"""The lamp counts as shining straight into the detector within this many degrees."""


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
    is_open : bool
        Whether the shutter was told to be open.
    """

    def __init__(self, rig: Rig, settings: EmulatorSettings, clock: Clock) -> None:
        self.rig = rig
        self.settings = settings
        self.clock = clock
        self.axes: Callable[[], tuple[float, ...]] = lambda: (0.0, 0.0, 0.0)
        self.lamp_factor = 1.0
        self.is_open = False
        self._moved_at = -np.inf
        self._lock = threading.Lock()
        self._random = np.random.default_rng([settings.seed, 77])
        pixel = np.arange(PIXELS, dtype=np.float64)
        coefficients = np.array(WAVELENGTH_COEFFICIENTS, dtype="<f4").astype(np.float64)
        self.wavelength: Array = np.asarray(np.polynomial.polynomial.polyval(pixel, coefficients))
        self._direct = settings.direct_rate * lamp_spectrum(self.wavelength, settings.lamp_temperature)
        self._surface = _surface(settings, self.wavelength)
        self._seen: tuple[tuple[float, ...], Array] | None = None

    def lamp(self) -> float:
        """Lamp power relative to its nominal one."""
        drift = self.settings.effects.lamp_drift
        return self.lamp_factor * (float(drift_factor(drift, self.clock.now())) if drift else 1.0)

    def move_shutter(self, is_open: bool) -> None:
        """Tell the shutter to open or close; it takes its time."""
        if is_open != self.is_open:
            self.is_open, self._moved_at = is_open, self.clock.now()

    def _opened(self, began: float, seconds: float) -> float:
        """Share of an exposure's light that the shutter lets through; it moves evenly."""
        effects = self.settings.effects
        if effects.shutter_stuck:
            return 1.0 if effects.shutter_stuck == "open" else 0.0
        if not effects.shutter_time:
            return float(self.is_open)
        times = began + (np.arange(64) + 0.5) / 64.0 * seconds
        share = np.clip((times - self._moved_at) / effects.shutter_time, 0.0, 1.0).mean()
        return float(share if self.is_open else 1.0 - share)

    def reference_reading(self) -> float:
        """One reading of the reference detector, W."""
        power = self.settings.reference_power * self.lamp()
        if self.settings.effects.reference_behind_shutter:
            power *= self._opened(self.clock.now(), 0.0)
        noise = self.settings.effects.reference_noise
        if noise:
            with self._lock:
                power *= 1.0 + noise * self._random.standard_normal()
        return power

    def rate(self) -> Array:
        """Return the counts per second and pixel that the open shutter lets through, before any effect."""
        errors = self.settings.effects.zero_errors
        axes = tuple(read + error for read, error in zip(self.axes(), errors, strict=True))
        if self._seen is None or self._seen[0] != axes:
            self._seen = (axes, self._direct * self._share(axes))
        return self._seen[1]

    def _share(self, axes: tuple[float, ...]) -> Array | float:
        """Share of the incident power that reaches the detector: 1 in the direct beam, else f Ω cosθr."""
        lamp, turn, pitch = axes
        pose = forward(np.array([axes]))
        theta_i, theta_r = float(pose.theta_i[0]), float(pose.theta_r[0])
        width = self.settings.effects.beam_width
        off = abs(abs(lamp) - 180.0)
        if width and off < 6.0 * width and abs(np.cos(np.deg2rad(turn))) < EDGE_ON:
            return float(np.exp(-0.5 * (off / width) ** 2))
        if not width and off < DIRECT_TOLERANCE and abs(np.cos(np.deg2rad(turn))) < 0.01:
            return 1.0
        del pitch
        # The holder's rim: a little beyond what the rig file allows nothing is lit or seen.
        rim = min(90.0, self.rig.geometry.largest_zenith + RIM)
        if theta_i >= rim or theta_r >= rim or abs(lamp) < self.rig.geometry.lamp_shadow / 2.0:
            return 0.0
        directions = Directions.relative(pose.theta_i, pose.theta_r, pose.phi_r - pose.phi_i)
        return self._surface(directions) * self.rig.geometry.solid_angle * float(cos_deg(theta_r))

    def counts(self, seconds: float, began: float) -> npt.NDArray[np.uint16]:
        """Raw counts (1024,) of an exposure that began at a time of the rig."""
        effects = self.settings.effects
        age = self.clock.now() if effects.dark_drift else 0.0
        dark = float(dark_counts(self.settings.dark_rate, effects.dark_drift, seconds, age))
        share = self._opened(began, seconds)
        signal = self.rate() * (seconds * self.lamp() * share) if share else np.zeros(len(self.wavelength))
        if effects.stray_light:
            signal = with_stray_light(signal, effects.stray_light)
        with self._lock:
            if effects.shot_noise:
                gain = self.rig.spectrometer.electrons_per_count
                signal = with_shot_noise(signal, dark, gain, self._random.poisson)
            if effects.read_noise:
                deviates = self._random.standard_normal(len(signal))
                signal = with_read_noise(signal, effects.read_noise, deviates)
        if effects.nonlinearity:
            signal = shown_counts(signal, effects.nonlinearity, FULL_SCALE)
        total = np.rint(self.rig.spectrometer.bias + dark + signal)
        return np.clip(total, 0, effects.clip or FULL_SCALE).astype(np.uint16)


def _surface(settings: EmulatorSettings, wavelength: Array) -> Callable[[Directions], Array]:
    """Return f_r (P,) in 1/sr of one direction, at every pixel."""
    if settings.scan:
        return _scan_surface(Scan.open(settings.scan), wavelength)
    model = get_model(settings.model)
    curves = model_curves(settings.parameters)
    named = curves(wavelength)
    named |= {row.name: wavelength for row in model.parameters if row.given == "wavelength"}
    vector = np.atleast_2d(model.vector(named))[:, None, :]

    def brdf(directions: Directions) -> Array:
        return np.broadcast_to(model.brdf(vector, model.features(directions))[:, 0], wavelength.shape)

    return brdf


def _scan_surface(scan: Scan, wavelength: Array) -> Callable[[Directions], Array]:
    """Return the nearest measured direction, straight lines between wavelengths; masked values count as 0."""
    values = np.where(scan.mask, 0.0, scan.brdf)
    nearest = nearest_direction(scan)

    def brdf(directions: Directions) -> Array:
        return np.asarray(np.interp(wavelength, scan.wavelength, values[int(nearest(directions)[0])]))

    return brdf

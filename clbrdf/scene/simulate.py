"""From a scene to BRDF values: the light's path, block by block, and no step that is not asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.instrument.aperture import solid_angle
from clbrdf.instrument.misalignment import misaligned
from clbrdf.opencl.device import Device
from clbrdf.progress import Report, silent
from clbrdf.scan import Component, Correlation, Scan
from clbrdf.scan.effects import SETTINGS
from clbrdf.scan.flags import FLAGS
from clbrdf.scene.block import Block
from clbrdf.scene.quadrature import INTEGRATED, Told, check_horizon, integrate
from clbrdf.scene.random_numbers import normal
from clbrdf.scene.scenefile import Scene
from clbrdf.scene.steps import RANDOM, steps
from clbrdf.scene.surface import Surface, make_surface

Array = npt.NDArray[np.float64]

BLOCK_VALUES = 1 << 20
"""Values of a block: 4 or 8 MiB, and as much again for what an effect makes of them."""

SATURATED = "saturated"


@dataclass(frozen=True, eq=False)
class Setting:
    """A scene made ready: surface, nominal directions, where they really point, the factor that follows.

    Attributes
    ----------
    scene : Scene
    surface : Surface
    places : (N,) int
        Of the directions in the scene.
    nominal, true : Directions
        N; one record where nothing is misaligned.
    factor : (N,) float64 or None
        Of the values, from the misalignment; None without it.
    told : Told
        Filled while it runs.
    """

    scene: Scene
    surface: Surface
    places: npt.NDArray[np.intp]
    nominal: Directions
    true: Directions
    factor: Array | None
    told: Told = field(default_factory=Told)

    @property
    def wavelength(self) -> Array:
        """(W,), nm."""
        return np.array(self.scene.wavelength)


def set_up(
    scene: Scene,
    surface: Surface | None = None,
    device: Device | None = None,
    places: npt.NDArray[np.intp] | None = None,
) -> Setting:
    """Make a scene ready; with `places`, only some of its directions.

    Raises
    ------
    InputError
        Directions that an effect turns or spreads below the horizon, or as `make_surface`.
    DeviceError
        No usable OpenCL device.
    """
    nominal = scene.directions.directions()
    true, factor = nominal, None
    if scene.effects.misalignment is not None:
        deviates = normal(scene.seed, "misalignment", 0, len(nominal), 2)
        true, factor = misaligned(scene.effects.misalignment, nominal, deviates)
    if places is None:
        places = np.arange(len(nominal))
    else:
        same = true is nominal
        nominal = nominal[places]
        true = nominal if same else true[places]
        factor = None if factor is None else factor[places]
    check_horizon(scene.effects, true)
    return Setting(scene, surface or make_surface(scene, device), places, nominal, true, factor)


def raw_blocks(setting: Setting, block_values: int = BLOCK_VALUES) -> Iterator[Block]:
    """Give the scene's values block by block, before any effect on values."""
    rows = max(1, block_values // len(setting.scene.wavelength))
    for part, values in _surface_blocks(setting, rows):
        if setting.factor is not None:
            values = values * setting.factor[part, None]
        yield Block(part.start, setting.places[part], setting.nominal[part], values)


def _surface_blocks(setting: Setting, rows: int) -> Iterator[tuple[slice, npt.NDArray[np.floating]]]:
    effects, wavelength = setting.scene.effects, setting.wavelength
    if all(getattr(effects, name) is None for name in INTEGRATED):
        yield from setting.surface.blocks(setting.true, wavelength, rows)
        return
    rtol = max(setting.scene.rtol, setting.surface.bound)
    for start in range(0, len(setting.true), rows):
        part = slice(start, min(start + rows, len(setting.true)))
        true = setting.true[part]
        yield part, integrate(setting.surface, effects, true, wavelength, rtol, setting.told)


def blocks(setting: Setting, block_values: int = BLOCK_VALUES) -> Iterator[Block]:
    """Give the scene's values block by block, with every effect that it asks for."""
    path = steps(setting.scene)
    for block in raw_blocks(setting, block_values):
        for _, step in path:
            block = step(setting.scene, block)
        yield block


def values_of(setting: Setting) -> Array:
    """Return BRDF values (N, W) of a scene, with its effects, in memory."""
    if not setting.scene.effects.on():
        return setting.surface.values(setting.true, setting.wavelength)
    return np.concatenate([np.asarray(block.values, dtype=np.float64) for block in blocks(setting)])


def simulate(
    scene: Scene,
    *,
    device: Device | None = None,
    report: Report = silent,
    block_values: int = BLOCK_VALUES,
) -> Scan:
    """Simulate a scene in memory.

    Parameters
    ----------
    scene : Scene
        From `load_scene`, or made in Python.
    device : Device, optional
    report : callable
        Told the directions done and in all.
    block_values : int
        Values computed at once; it changes no value.

    Returns
    -------
    Scan
        With uncertainties where effects are random, and with flags where values are saturated.

    Raises
    ------
    InputError
        Directions below the horizon, a file of the surface that cannot be used.
    DeviceError
        No usable OpenCL device.
    """
    setting = set_up(scene, device=device)
    n, w = len(setting.nominal), len(scene.wavelength)
    brdf = np.empty((n, w))
    sigma = np.empty((n, w)) if has_sigma(scene) else None
    noise = np.zeros((n, w)) if has_noise(scene) else None
    flags = np.zeros((n, w), np.uint32)
    for block in blocks(setting, block_values):
        part = slice(block.start, block.start + len(block.places))
        brdf[part] = block.values
        if sigma is not None and block.variance is not None:
            sigma[part] = np.sqrt(block.variance)
            if noise is not None:
                noise[part] = noise_of(block)
        if block.flagged is not None:
            flags[part] = block.flagged * np.uint32(1 << len(FLAGS))
        report(part.stop, n)
    solid, bandpass = receiver(scene, n)
    return Scan(
        setting.nominal.theta_i,
        np.zeros(1),
        setting.nominal.theta_r,
        setting.nominal.phi,
        setting.wavelength,
        brdf,
        sigma=sigma,
        flags=flags,
        flag_names=flag_names(scene),
        sample=scene.sample,
        instrument=instrument(scene),
        solid_angle=solid,
        bandpass=bandpass,
        effects=told_effects(scene),
        components=components_of(scene, 0.0 if noise is None else noise),
        provenance={"made_by": "clbrdf simulate", "seed": str(scene.seed)},
    )


def has_sigma(scene: Scene) -> bool:
    """Whether the values scatter by effects whose size is known."""
    return any(getattr(scene.effects, name) is not None for name in RANDOM)


def has_noise(scene: Scene) -> bool:
    """Whether values have noise from counting or reading."""
    return scene.effects.shot_noise is not None or scene.effects.read_noise is not None


def noise_of(block: Block) -> Array:
    """Return the standard uncertainty (n, W), 1/sr, of the noise in a block's values."""
    variance = block.variance if block.noise is None else block.noise
    assert variance is not None
    return np.sqrt(variance)


def components_of(scene: Scene, noise: npt.ArrayLike) -> tuple[Component, ...]:
    """Return the components of a scene's uncertainty: of those effects that scatter by a known size.

    Stages that stop a little off scatter, too, by the slope of what they look at; the scene does not know it.
    """
    out = []
    random, systematic = Correlation("random"), Correlation("systematic")
    if has_noise(scene):
        out.append(Component("noise", noise, False, random, systematic, random))
    reader = scene.effects.reader
    if reader is not None and reader.percent > 0.0:
        over_directions = systematic if reader.each == "scan" else random
        over_wavelengths = random if reader.each == "value" else systematic
        share = reader.percent / 100.0
        out.append(Component("reader", share, True, over_directions, systematic, over_wavelengths))
    return tuple(out)


def flag_names(scene: Scene) -> tuple[str, ...]:
    """Names of the reasons for masking."""
    return FLAGS if scene.effects.saturation is None else (*FLAGS, SATURATED)


def receiver(scene: Scene, directions: int) -> tuple[Array | None, Array | None]:
    """Return what a scan says of its receiver: solid angles (N,), sr, and bandpass (W,), nm, or None."""
    aperture, bandwidth = scene.effects.aperture, scene.effects.bandwidth
    return (
        None if aperture is None else np.full(directions, solid_angle(aperture.angle)),
        None if bandwidth is None else np.full(len(scene.wavelength), bandwidth.width),
    )


def told_effects(scene: Scene) -> dict[str, dict[str, float | bool]]:
    """Return the other effects that a scan tells of and a fit can take out, with their settings."""
    out = {}
    for name, known in SETTINGS.items():
        effect = getattr(scene.effects, name)
        if effect is not None:
            out[name] = {key: getattr(effect, key) for key in known}
    lean = scene.effects.misalignment
    if lean is not None and lean.tilt == 0.0 and lean.height == 0.0:
        del out["misalignment"]  # nothing but where stages stop, which is noise
    return out


def instrument(scene: Scene) -> str:
    """Return what a scan says of its instrument."""
    return f"none: simulated with {', '.join(scene.effects.on()) or 'no effects'}"

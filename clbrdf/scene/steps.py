"""The effects on values, one step each, in the order of the light's path.

A step takes a block and gives the next one; the scene calls the steps it asks for and no other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.instrument import aperture, footprint
from clbrdf.scene.block import Block
from clbrdf.scene.detector import ExposedDirections, expose
from clbrdf.scene.effects import dark, lamp_drift, nonlinearity, read_noise, saturation
from clbrdf.scene.effects import shot_noise as shot
from clbrdf.scene.effects import stray_light as stray
from clbrdf.scene.random_numbers import normal, uniform
from clbrdf.scene.scenefile import Scene

Array = npt.NDArray[np.float64]

Step = Callable[[Scene, Block], Block]

DEFAULT_SOLID_ANGLE = 1e-3


def _exposure(block: Block) -> ExposedDirections:
    assert block.exposure is not None
    return block.exposure


def to_counts(scene: Scene, block: Block) -> Block:
    """BRDF to net counts."""
    cone = scene.effects.aperture
    solid = scene.detector.solid_angle
    if solid is None:
        solid = DEFAULT_SOLID_ANGLE if cone is None else aperture.solid_angle(cone.angle)
    values = np.asarray(block.values, dtype=np.float64)
    exposure = expose(scene.detector, solid, np.array(scene.wavelength), block.directions.theta_r, values)
    return replace(block, values=values * exposure.scale, exposure=exposure)


def to_brdf(scene: Scene, block: Block) -> Block:
    """Net counts to BRDF, as the instrument reckons it by (2)."""
    del scene
    scale = _exposure(block).scale
    variance = None if block.variance is None else block.variance / scale**2
    return replace(block, values=block.values / scale, variance=variance, exposure=None)


def _footprint(scene: Scene, block: Block) -> Block:
    assert scene.effects.footprint is not None
    share = footprint.seen_share(scene.effects.footprint, block.directions)
    return replace(block, values=block.values * share[:, None])


def _lamp_drift(scene: Scene, block: Block) -> Block:
    settings = scene.effects.lamp_drift
    assert settings is not None
    factor = lamp_drift.drift_factor(settings.per_hour, block.age(settings.interval))
    return replace(block, values=block.values * factor)


def _stray_light(scene: Scene, block: Block) -> Block:
    assert scene.effects.stray_light is not None
    return replace(block, values=stray.with_stray_light(block.values, scene.effects.stray_light.share))


def _dark(scene: Scene, block: Block) -> Block:
    settings = scene.effects.dark
    assert settings is not None
    seconds = _exposure(block).seconds
    there = dark.dark_counts(settings.rate, settings.drift, seconds, block.age(settings.interval))
    taken = settings.rate * seconds if settings.subtracted else 0.0
    return replace(block, values=block.values + (there - taken), subtracted=taken)


def _shot_noise(scene: Scene, block: Block) -> Block:
    gain = scene.detector.electrons_per_count
    numbers = uniform(scene.seed, "shot_noise", block.start, *block.values.shape)

    def draw(mean: Array) -> Array:
        return shot.poisson_quantile(mean, numbers)

    values = shot.with_shot_noise(block.values, block.subtracted, gain, draw)
    variance = np.maximum(block.values + block.subtracted, 0.0) / gain
    return replace(block, values=values, variance=block.plus_variance(variance))


def _nonlinearity(scene: Scene, block: Block) -> Block:
    assert scene.effects.nonlinearity is not None
    top = scene.detector.full_scale
    coefficients = nonlinearity.in_counts(scene.effects.nonlinearity.polynomial, top)
    return replace(block, values=nonlinearity.shown_counts(block.values, coefficients, top))


def _read_noise(scene: Scene, block: Block) -> Block:
    assert scene.effects.read_noise is not None
    sigma = scene.effects.read_noise.sigma
    deviates = normal(scene.seed, "read_noise", block.start, *block.values.shape)
    variance = block.plus_variance(np.full(block.values.shape, sigma**2))
    return replace(block, values=read_noise.with_read_noise(block.values, sigma, deviates), variance=variance)


def _saturation(scene: Scene, block: Block) -> Block:
    room = scene.detector.full_scale - scene.detector.bias - block.subtracted
    values, cut = saturation.cut_at(block.values, room)
    return replace(block, values=values, flagged=cut if cut.any() else None)


def _reader(scene: Scene, block: Block) -> Block:
    settings = scene.effects.reader
    assert settings is not None
    n, w = block.values.shape
    if settings.each == "value":
        deviates = normal(scene.seed, "reader", block.start, n, w)
    elif settings.each == "direction":
        deviates = normal(scene.seed, "reader", block.start, n, 1)
    else:
        deviates = normal(scene.seed, "reader", 0, 1, 1)
    share = settings.percent / 100.0
    variance = block.plus_variance((share * block.values) ** 2)
    values = block.values * (1.0 + share * deviates)
    return replace(block, values=values, variance=variance, noise=block.variance)


STEPS: dict[str, Step] = {
    "footprint": _footprint,
    "lamp_drift": _lamp_drift,
    "stray_light": _stray_light,
    "dark": _dark,
    "shot_noise": _shot_noise,
    "nonlinearity": _nonlinearity,
    "read_noise": _read_noise,
    "saturation": _saturation,
    "reader": _reader,
}
"""By effect, in the order of the light's path."""

ON_COUNTS = ("stray_light", "dark", "shot_noise", "nonlinearity", "read_noise", "saturation")
RANDOM = ("shot_noise", "read_noise", "reader")
"""Effects whose scatter the scan's uncertainties tell."""

COUNTS, BACK = "to counts", "to BRDF"


def steps(scene: Scene) -> list[tuple[str, Step]]:
    """Return the steps that a scene asks for, by the effect's name; counts only where one needs them."""
    named = [(name, STEPS[name]) for name in STEPS if getattr(scene.effects, name) is not None]
    counted = [j for j, (name, _) in enumerate(named) if name in ON_COUNTS]
    if counted:
        named.insert(counted[-1] + 1, (BACK, to_brdf))
        named.insert(counted[0], (COUNTS, to_counts))
    return named

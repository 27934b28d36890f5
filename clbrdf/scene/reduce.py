"""Leave out or coarsen what moves the result by less than a tolerance, and say so.

Half of the tolerance goes to effects that are left out, those that move least first, while the sum of their
largest moves fits in; a quarter to the integrals, a quarter to the arithmetic. The moves are measured on a
few directions, the nearest to the mirror direction among them: they are found, not proven.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clbrdf.evaluate import WORTH_MEASURING
from clbrdf.opencl.cheapest import choose_precision
from clbrdf.scene.ledger import Ledger, keep_ledger
from clbrdf.scene.quadrature import INTEGRATED
from clbrdf.scene.simulate import Setting, set_up
from clbrdf.scene.surface import ModelSurface

TRIED = 64
"""Directions on which the moves are measured."""

LEAVE_OUT, INTEGRALS, ARITHMETIC = 0.5, 0.25, 0.25
"""Shares of the tolerance."""


@dataclass(frozen=True)
class Reduced:
    """A scene with what does not matter left out, and what was done, in words."""

    setting: Setting
    words: tuple[str, ...]


def reduce_scene(setting: Setting, rtol: float) -> Reduced:
    """Return a scene whose values differ from the whole one's by about rtol, relative, at most.

    Raises
    ------
    InputError
        A tolerance that no precision keeps.
    """
    scene, words = setting.scene, []
    surface = setting.surface
    if isinstance(surface, ModelSurface):
        values = len(setting.nominal) * len(scene.wavelength)
        choice = choose_precision(
            ARITHMETIC * rtol,
            device=surface.device,
            model=surface.model.name,
            measure=values >= WORTH_MEASURING,
        )
        surface = replace(surface, precision=choice.precision)
        words.append(f"arithmetic: {choice}")
    finest, coarser = scene.rtol, max(scene.rtol, INTEGRALS * rtol)
    scene = scene.model_copy(update={"rtol": coarser})
    if scene.effects.on():
        places = tried_places(setting)
        ledger = keep_ledger(set_up(scene, surface, places=places))
        absent = negligible(ledger, LEAVE_OUT * rtol)
        tried = f"on {len(places)} of {len(setting.nominal)} directions"
        words += [
            f"left out {name}: it moves the result by {ledger.effects[name].largest:.2g} at most, {tried}"
            for name in absent
        ]
        scene = scene.model_copy(update={"effects": scene.effects.without(absent)})
    integrated = [name for name in INTEGRATED if getattr(scene.effects, name) is not None]
    if integrated and coarser > finest:
        words.append(f"{', '.join(integrated)}: integrated to {coarser:.2g}, not {finest:.2g}")
    return Reduced(set_up(scene, surface), tuple(words))


def negligible(ledger: Ledger, allowed: float) -> tuple[str, ...]:
    """Return the effects that move least, as many as their largest moves add up to less than allowed."""
    absent: list[str] = []
    for entry in sorted(ledger.effects.values(), key=lambda entry: entry.largest):
        allowed -= entry.largest
        if allowed < 0.0:
            break
        absent.append(entry.name)
    return tuple(absent)


def tried_places(setting: Setting) -> npt.NDArray[np.intp]:
    """Return places of directions spread over the scene, and of those nearest to the mirror direction."""
    n = len(setting.nominal)
    if n <= TRIED:
        return np.arange(n)
    spread = np.linspace(0, n - 1, TRIED // 2).round().astype(np.intp)
    d = setting.nominal
    away = np.abs(d.theta_i - d.theta_r) + np.abs(d.phi - 180.0) * np.sin(np.deg2rad(d.theta_r))
    nearest = np.argsort(away, kind="stable")[: TRIED // 2]
    return np.unique(np.concatenate([spread, nearest]))

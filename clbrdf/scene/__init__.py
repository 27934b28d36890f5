"""Scenes: what is lit, how, and what looks at it; simulated with the effects that are called for.

    from clbrdf.scene import load_scene, simulate
    scan = simulate(load_scene("scene.toml"))

`scenefile` reads, `surface` evaluates, `quadrature` integrates, `stages` and `effects/` bend, `stream`
writes, `ledger` tells what each effect costs, `reduce` leaves out what does not matter, `checks` looks at
the surface.
"""

from clbrdf.scene.scenefile import Scene, load_scene
from clbrdf.scene.simulate import simulate

__all__ = ["Scene", "load_scene", "simulate"]

"""The scene: a sphere and a flat panel of the material on a grey floor, under two lamps and a dim sky.

Lengths are in radii of the sphere. Lamps, sky and floor are neutral: the illuminant is in the material,
whose bands hold what the eye gets under it. For light that meets the material once that is exact, and hardly
any other light comes to the eye.
"""

from __future__ import annotations

from typing import Any

LAMP, STRIP, SKY = 16.0, 9.0, 0.35
"""Radiances of the lamps and the sky; the picture is scaled by `WHITE`."""

FLOOR = 0.4
"""Reflectance of the floor: black and white surfaces both stand out from it."""


def stage(mi: Any, material_file: str, width: int, height: int, samples: int) -> dict[str, Any]:
    """Return the scene as Mitsuba takes it, with the material of a tensor file.

    Parameters
    ----------
    mi : module
        Mitsuba, with a variant set.
    samples : int
        Of a pixel in one pass.
    """
    T = mi.ScalarTransform4f

    def lamp(origin: list[float], target: list[float], size: list[float], radiance: float) -> dict[str, Any]:
        placed = T().look_at(origin=origin, target=target, up=[0, 0, 1]) @ T().scale([*size, 1.0])
        light = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
        return {"type": "rectangle", "to_world": placed, "emitter": light}

    measured = {"type": "measured", "filename": material_file}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov": 30.0,
            "fov_axis": "x",
            "to_world": T().look_at(origin=[0.15, -9.2, 2.9], target=[0.15, 0.0, 0.92], up=[0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "gaussian"},
            },
            "sampler": {"type": "multijitter", "sample_count": samples},
        },
        "material": measured | {"id": "material"},
        "sphere": {
            "type": "sphere",
            "center": [-1.08, 0.0, 1.0],
            "radius": 1.0,
            "bsdf": {"type": "ref", "id": "material"},
        },
        "panel": {
            "type": "rectangle",
            "to_world": T().translate([1.3, 0.25, 0.97])
            @ T().rotate([0, 0, 1], -20.0)
            @ T().rotate([1, 0, 0], 71.0),
            "bsdf": {"type": "ref", "id": "material"},
        },
        "floor": {
            "type": "rectangle",
            "to_world": T().scale([200.0, 200.0, 1.0]),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": FLOOR}},
        },
        "lamp": lamp([-3.6, -4.2, 5.4], [0.0, 0.0, 0.9], [1.1, 1.1], LAMP),
        "strip": lamp([4.6, -2.2, 3.0], [0.2, 0.0, 1.0], [0.35, 1.5], STRIP),
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": SKY}},
    }

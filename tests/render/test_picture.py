"""Pictures: what Mitsuba makes of known materials, and what is done with its numbers."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from clbrdf.colour import encode_srgb
from clbrdf.formats.rgl.export import export_material
from clbrdf.render.picture import FULL, SHOULDER, develop, fitting_exposure, render, save_picture
from tests.formats.rgl.materials import MATERIALS, coloured, ggx, lambert, total

SIZE = (160, 100)


def picture(brdf, colour=(1.0, 1.0, 1.0), samples=16):
    pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    return render(export_material(coloured(brdf, colour), 0.02), samples, size=SIZE)


# Places of the sphere, lit and in its shadow side, of the panel and of the floor, on a picture of 160 × 100.
SPHERE, PANEL, FLOOR = (
    (slice(35, 45), slice(28, 40)),
    (slice(35, 60), slice(100, 125)),
    (slice(92, 98), slice(0, 160)),
)


def test_white_comes_out_below_white_and_half_of_it_half():
    white, half = picture(lambert(1.0)), picture(lambert(0.5))
    for place in (SPHERE, PANEL):
        assert 0.3 < white[place].mean() < 0.9
        assert half[place].mean() == pytest.approx(white[place].mean() / 2.0, rel=0.03)
    np.testing.assert_allclose(half[FLOOR].mean(), white[FLOOR].mean(), rtol=0.05)
    assert white.max() < 1.0


def test_a_diffuse_sphere_is_what_mitsuba_itself_makes_of_one():
    """The same scene with Mitsuba's own Lambertian plugin instead of our file."""
    mi = pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'clbrdf[render]'")
    from clbrdf.render.mitsuba_scene import stage
    from clbrdf.render.picture import PASS, WHITE, load_mitsuba

    ours = picture(lambert(0.6), samples=64)
    load_mitsuba()
    scene = stage(mi, "unused", *SIZE, PASS)
    scene["material"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.6}, "id": "material"}
    theirs = WHITE * np.asarray(mi.render(mi.load_dict(scene), spp=64), dtype=float)
    for place in (SPHERE, PANEL):
        assert ours[place].mean() == pytest.approx(theirs[place].mean(), rel=0.02)
    away = np.abs(ours - theirs)
    # Noise of 64 paths; silhouettes hold a pixel of either.
    assert np.quantile(away, 0.95) < 0.05


def test_colour_goes_through():
    image = picture(lambert(1.0), (0.8, 0.4, 0.1))
    red, green, blue = image[PANEL].mean(axis=(0, 1))
    assert red / green == pytest.approx(2.0, rel=0.02)
    assert green / blue == pytest.approx(4.0, rel=0.02)


def test_a_glossy_black_shows_its_lamps():
    image = picture(total(ggx(0.03, 0.04), lambert(0.005)))
    assert image[SPHERE].max() > 10.0 * np.median(image[SPHERE])
    assert image.min() >= 0.0


def test_foil_is_not_all_white():
    image = picture(MATERIALS["tin foil"], (0.9, 0.75, 0.25))
    stops = fitting_exposure([image])
    assert -6.0 < stops < 0.0
    assert (develop(image, stops).max(axis=-1) < 255).mean() > 0.85


def test_exposure_is_common_and_never_brightens():
    dark, bright = np.full((4, 4, 3), 0.1), np.full((4, 4, 3), 3.6)
    assert fitting_exposure([dark]) == 0.0
    assert fitting_exposure([dark, bright]) == pytest.approx(np.log2(FULL / 3.6))


def test_development_keeps_order_and_hue():
    values = np.linspace(0.0, 50.0, 2001)[:, None] * np.array([1.0, 0.5, 0.25])
    pixels = develop(values).astype(int)
    assert (np.diff(pixels, axis=0) >= 0).all()
    below = values[:, 0] < SHOULDER
    np.testing.assert_allclose(pixels[below], 255.0 * encode_srgb(values[below]), atol=0.5)
    assert pixels[-1].tolist()[0] >= 253
    # The ratio of the channels is kept in the highlights: 1 : 0.5 : 0.25.
    np.testing.assert_allclose(pixels[-1] / 255.0, encode_srgb(np.array([1.0, 0.5, 0.25])), atol=0.02)
    assert (develop(np.full((1, 3), 0.1), 1.0) == develop(np.full((1, 3), 0.2))).all()


def test_pictures_stand_side_by_side(tmp_path):
    first, second = np.full((50, 80, 3), 200, np.uint8), np.full((50, 80, 3), 30, np.uint8)
    path = tmp_path / "two.png"
    save_picture(path, [first, second], ["a name that is by far too long for its picture", "b"], False)
    pixels = np.asarray(Image.open(path))
    assert pixels.shape == (50 + 24, 164, 3)
    assert (pixels[:50, :80] == 200).all()
    assert (pixels[:50, 84:] == 30).all()
    assert (pixels[50:, 80:84] == 255).all()

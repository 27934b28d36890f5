"""Pictures of materials by Mitsuba."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.colour import encode_srgb
from clbrdf.errors import InputError
from clbrdf.formats.rgl.export import Export
from clbrdf.formats.rgl.tables import write_tables
from clbrdf.parallel.ending import scratch_folder
from clbrdf.progress import Report
from clbrdf.render.mitsuba_scene import stage
from clbrdf.storage.files import whole_file

Array = npt.NDArray[np.float64]

VARIANT = "scalar_rgb"
WIDTH, HEIGHT = 720, 450
SAMPLES = 64
PASS = 16
"""Samples of a pixel that are taken at a time: between passes progress shows and Ctrl-C is heard."""

WHITE = 0.62
"""Scales radiance so that the lit side of a perfectly white sphere comes out just below 1."""

MOST_RADIANCE = 25.0
"""What the largest channel of a pixel is brought down to in one pass: at grazing angles models rise without
bound, and a single path would leave a bright dot."""

MOSTLY, FULL = 0.88, 0.9
"""Where an exposure is to be found, so much of the picture stays below this value."""

SHOULDER = 0.75
"""Where highlights begin to be compressed, so that their shape shows instead of a flat white."""


def load_mitsuba() -> Any:
    """Return Mitsuba with the variant that pictures are made with.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        import mitsuba
    except ImportError as error:
        raise InputError("pictures need Mitsuba; install it with: pip install 'clbrdf[render]'") from error
    mitsuba.set_variant(VARIANT)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba


def render(
    export: Export,
    samples: int = SAMPLES,
    report: Report | None = None,
    size: tuple[int, int] = (WIDTH, HEIGHT),
) -> Array:
    """Return linear sRGB, (height, width, 3), of the scene with an exported RGB material.

    Raises
    ------
    InputError
        Mitsuba is not installed.
    """
    mi = load_mitsuba()
    total, done = np.zeros((size[1], size[0], 3)), 0
    with scratch_folder() as folder:
        path = folder / "material.bsdf"
        write_tables(path, export.tables)
        scene = mi.load_dict(stage(mi, str(path), *size, PASS))
        while done < samples:
            image = np.asarray(mi.render(scene, spp=PASS, seed=done), dtype=np.float64)
            largest = image.max(axis=-1, keepdims=True)
            total += image * np.minimum(1.0, MOST_RADIANCE / np.maximum(largest, MOST_RADIANCE))
            done += PASS
            if report is not None:
                report(min(done, samples), samples)
    return WHITE * PASS * total / done


def fitting_exposure(pictures: Sequence[Array]) -> float:
    """Return by how many stops pictures have to be darkened so that most of each is not white; 0 or less.

    Models may reflect more light than comes in, and mirrors show their lamp.
    """
    bright = max(float(np.quantile(picture.max(axis=-1), MOSTLY)) for picture in pictures)
    return float(min(0.0, np.log2(FULL / max(bright, FULL))))


def develop(linear: Array, stops: float = 0.0) -> npt.NDArray[np.uint8]:
    """Return encoded sRGB, 8 bits, brightened by photographic stops; highlights are compressed.

    Above the shoulder s a value v becomes s + (1 − s) x/(1 + x) with x = (v − s)/(1 − s), which goes on with
    the same slope and never reaches 1. The largest channel decides, so that highlights keep their hue.
    """
    values = np.maximum(linear, 0.0) * 2.0**stops
    largest = values.max(axis=-1, keepdims=True)
    beyond = np.maximum(largest - SHOULDER, 0.0) / (1.0 - SHOULDER)
    pressed = SHOULDER + (1.0 - SHOULDER) * beyond / (1.0 + beyond)
    scale = np.where(largest > SHOULDER, pressed / np.maximum(largest, SHOULDER), 1.0)
    return np.asarray(np.rint(255.0 * encode_srgb(values * scale)), dtype=np.uint8)


def save_picture(
    path: str | Path, pictures: Sequence[npt.NDArray[np.uint8]], captions: Sequence[str], overwrite: bool
) -> None:
    """Write pictures side by side as a PNG, each with its caption below, whole or not at all.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or it cannot be written.
    """
    from matplotlib import font_manager
    from PIL import Image, ImageDraw, ImageFont

    height, width = pictures[0].shape[:2]
    band, gap = max(24, height // 14), 4 if len(pictures) > 1 else 0
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), int(0.5 * band))
    sheet = Image.new("RGB", (len(pictures) * (width + gap) - gap, height + band), "white")
    draw = ImageDraw.Draw(sheet)
    for k, (pixels, caption) in enumerate(zip(pictures, captions, strict=True)):
        left = k * (width + gap)
        sheet.paste(Image.fromarray(pixels), (left, 0))
        while caption and draw.textlength(caption, font) > width - 16:
            caption = caption[:-2] + "…"
        draw.text((left + 8, height + band // 2), caption, fill="black", font=font, anchor="lm")
    with whole_file(path, overwrite) as part:
        sheet.save(part, format="PNG")

"""Pictures in files: PNG stills, GIF and MP4 sweeps over wavelength or incident angle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from clbrdf.errors import InputError, advice, settled
from clbrdf.progress import Report, silent
from clbrdf.storage.files import check_output, whole_file
from clbrdf.viz.picture import Picture
from clbrdf.viz.radius import common_scale

Pixels = npt.NDArray[np.uint8]
Sweep = Literal["wavelength", "theta-i"]

FRAMES_A_SECOND = 12
MOST_FRAMES = 1000


def pixels(picture: Picture, transparent: bool = False) -> Pixels:
    """Draw a picture; rows × columns × 3 (red, green, blue) or 4 (and opacity), 8 bits."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

    window = picture.plotter.render_window
    picture.background.SetBackgroundAlpha(0.0 if transparent else 1.0)
    window.SetAlphaBitPlanes(1)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.SetInputBufferType(4 if transparent else 3)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    grab.Update()
    image = grab.GetOutput()
    width, height, _ = image.GetDimensions()
    flat = vtk_to_numpy(image.GetPointData().GetScalars())
    drawn = np.asarray(flat.reshape(height, width, -1)[::-1], dtype=np.uint8)
    return with_halo(drawn, max(2, picture.letter // 6)) if transparent else drawn


def with_halo(drawn: Pixels, width: int) -> Pixels:
    """Lay a picture (rows × columns × 4) over a white rim of its own shape: words stay legible on black.

    `width` is that of the rim, pixels.
    """
    from PIL import Image, ImageFilter

    shape = Image.fromarray(np.ascontiguousarray(drawn[..., 3]))
    rim = shape.filter(ImageFilter.MaxFilter(2 * width + 1)).filter(ImageFilter.GaussianBlur(width / 3.0))
    under = np.full(drawn.shape, 255, dtype=np.uint8)
    under[..., 3] = np.asarray(rim)
    whole = Image.fromarray(under)
    whole.alpha_composite(Image.fromarray(np.ascontiguousarray(drawn)))
    return np.asarray(whole)


def save_png(picture: Picture, path: str | Path, transparent: bool = False, overwrite: bool = False) -> None:
    """Write a PNG, whole or not at all.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or cannot be written.
    """
    from PIL import Image

    with whole_file(path, overwrite) as part:
        Image.fromarray(pixels(picture, transparent)).save(part, format="PNG")


def sweep_stops(picture: Picture, sweep: Sweep, frames: int | None = None) -> list[float]:
    """Return where a sweep stops: measured wavelengths (nm), or incident zeniths (degrees) over the measured.

    Raises
    ------
    InputError
        Nothing to sweep over, or a number of frames out of range.
    """
    if frames is not None and not 2 <= frames <= MOST_FRAMES:
        raise InputError(f"{settled('frames', '--frames', frames)}: a sweep has 2 to {MOST_FRAMES} frames")
    subject = picture.panels[0].requests[0].subject
    if sweep == "wavelength":
        stops = subject.wavelength
        if len(stops) < 2:
            raise InputError(
                f"{subject.name} has {subject.label(0)} only; sweep over angles:"
                f" {settled('sweep', '--sweep', 'theta-i')}"
            )
        if frames is not None and frames < len(stops):
            stops = stops[np.linspace(0, len(stops) - 1, frames).round().astype(int)]
        return [float(w) for w in stops]
    angles = subject.scan.incident_angles
    if len(angles) < 2:
        raise InputError(f"{subject.name} has one incident angle, {angles[0]:g}°; sweep the wavelength")
    if subject.fit is None:
        return [float(a) for a in angles]
    count = frames or int(min(max(angles[-1] - angles[0] + 1, 2), 61))
    return [round(float(a), 2) for a in np.linspace(angles[0], angles[-1], count)]


def hold_over(picture: Picture, sweep: Sweep, stops: Sequence[float]) -> None:
    """Hold one scale that fits every frame of a sweep, so that frames compare."""
    scales, paints = [], []
    for stop in stops:
        go(picture, sweep, stop)
        scales.append(picture.scale)
        paints.append(picture.paint)
    low, high = min(p.low for p in paints), max(p.high for p in paints)
    picture.hold(common_scale(scales), replace(paints[0], low=low, high=high))


def go(picture: Picture, sweep: Sweep, stop: float) -> None:
    """Show one stop of a sweep."""
    if sweep == "wavelength":
        picture.set(wavelength=stop)
    else:
        picture.set(theta_i=stop)


def frames_of(picture: Picture, sweep: Sweep, stops: Sequence[float], report: Report) -> Iterator[Pixels]:
    """Draw every stop of a sweep with one scale."""
    hold_over(picture, sweep, stops)
    for k, stop in enumerate(stops):
        go(picture, sweep, stop)
        yield pixels(picture)
        report(k + 1, len(stops))


def save_gif(
    picture: Picture,
    path: str | Path,
    sweep: Sweep,
    frames: int | None = None,
    overwrite: bool = False,
    report: Report = silent,
) -> int:
    """Write an endless GIF of a sweep, there and back, whole or not at all; return the number of stops.

    Raises
    ------
    InputError
        As `sweep_stops`, or the file cannot be written.
    """
    from PIL import Image

    stops = sweep_stops(picture, sweep, frames)
    with whole_file(path, overwrite) as part:
        # One palette for all frames, so that colours keep their meaning.
        drawn = [Image.fromarray(p) for p in frames_of(picture, sweep, stops, report)]
        palette = drawn[len(drawn) // 2].quantize(256, dither=Image.Dither.NONE)
        flat = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in drawn]
        flat += flat[-2:0:-1]
        flat[0].save(
            part,
            format="GIF",
            save_all=True,
            append_images=flat[1:],
            duration=round(1000 / FRAMES_A_SECOND),
            loop=0,
        )
    return len(stops)


def save_mp4(
    picture: Picture,
    path: str | Path,
    sweep: Sweep,
    frames: int | None = None,
    overwrite: bool = False,
    report: Report = silent,
) -> int:
    """Write an H.264 film of a sweep, whole or not at all; return the number of stops.

    Raises
    ------
    InputError
        The encoder (imageio-ffmpeg) is not installed, sides of odd length, or as `sweep_stops`.
    """
    writer_of = _encoder()
    if picture.size[0] % 2 or picture.size[1] % 2:
        raise InputError(f"size {picture.size[0]}x{picture.size[1]}: films need sides of even length")
    stops = sweep_stops(picture, sweep, frames)
    target = check_output(path, overwrite)
    with whole_file(target, overwrite) as part:
        film = part.with_suffix(".mp4")  # the encoder goes by the name's end
        try:
            writer = writer_of(
                str(film),
                picture.size,
                fps=FRAMES_A_SECOND,
                macro_block_size=2,
                quality=8,
                ffmpeg_log_level="error",
            )
            writer.send(None)
            try:
                for frame in frames_of(picture, sweep, stops, report):
                    writer.send(np.ascontiguousarray(frame))
            finally:
                writer.close()
            film.replace(part)
        finally:
            film.unlink(missing_ok=True)
    return len(stops)


def _encoder() -> Any:
    try:
        from imageio_ffmpeg import write_frames
    except ImportError:
        raise InputError(
            "films need the encoder: pip install 'clbrdf[film]'; or write a GIF with"
            f" {advice('save_gif', '--gif FILE')}"
        ) from None
    return write_frames

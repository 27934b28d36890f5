"""`clbrdf render`: a picture of a material by Mitsuba."""

from __future__ import annotations

import sys
from pathlib import Path

from clbrdf.cli.console import progress_bar
from clbrdf.cli.export_command import read_tolerance
from clbrdf.cli.export_rgl import percent, run_export
from clbrdf.cli.options import Output, Overwrite, number_list
from clbrdf.colour import DEFAULT_ILLUMINANT
from clbrdf.errors import InputError
from clbrdf.render.picture import (
    HEIGHT,
    SAMPLES,
    WIDTH,
    develop,
    fitting_exposure,
    load_mitsuba,
    render,
    save_picture,
)
from clbrdf.render.sources import in_colour, in_false_colour, open_source
from clbrdf.storage.files import check_apart, check_output

MOST_SAMPLES, LEAST_WIDTH, MOST_WIDTH = 4096, 100, 4000


def command(
    file: Path,
    /,
    *,
    output: Output,
    compare: Path | None = None,
    illuminant: str = DEFAULT_ILLUMINANT,
    false_colour: str | None = None,
    exposure: float | None = None,
    tolerance: str = "1%",
    samples: int = SAMPLES,
    width: int = WIDTH,
    overwrite: Overwrite = False,
) -> None:
    """Show a fitted or measured material on a sphere and a flat panel, rendered by Mitsuba.

    Brightness is absolute: a perfectly white surface comes out just below white, so that two pictures can
    be compared. Light that meets the material once is shown.

    Parameters
    ----------
    file
        fit, or a scan that can be interpolated
    compare
        another one, shown beside it
    illuminant
        D65, D50, A, E, FL2 or FL11; white is adapted to
    false_colour
        three wavelengths, nm, shown as red, green and blue, as in 650,550,450
    exposure
        brighter by so many photographic stops; by default 0, or less where the picture would be white
    tolerance
        of the material's file that Mitsuba is given
    samples
        light paths of a pixel; noise falls with their square root
    width
        pixels of one picture
    """
    files = [file] if compare is None else [file, compare]
    check_apart([output], files)
    target = check_output(output, overwrite)
    if not LEAST_WIDTH <= width <= MOST_WIDTH:
        raise InputError(f"--width {width}: give {LEAST_WIDTH} to {MOST_WIDTH} pixels")
    if not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"--samples {samples}: give 1 to {MOST_SAMPLES}")
    if exposure is not None and not -20.0 <= exposure <= 20.0:
        raise InputError(f"--exposure {exposure:g}: give -20 to 20 stops")
    allowed = read_tolerance(tolerance)
    chosen = None if false_colour is None else number_list("--false-colour", false_colour)
    load_mitsuba()
    pictures, captions = [], []
    size = width, width * HEIGHT // WIDTH
    for path in files:
        source = open_source(path)
        source = in_colour(source, illuminant) if chosen is None else in_false_colour(source, chosen)
        made = run_export(source, allowed, f"exporting {source.name}")
        with progress_bar(f"rendering {source.name}") as report:
            pictures.append(render(made, samples, report, size))
        captions.append(f"{source.name}, {source.origin}, {source.shown}")
        print(f"{source.name}: material within {percent(made.accuracy.reached)}", file=sys.stderr)
    stops = fitting_exposure(pictures) if exposure is None else exposure
    if stops:
        captions = [f"{caption}, {stops:+.1f} stops" for caption in captions]
    save_picture(target, [develop(picture, stops) for picture in pictures], captions, overwrite)
    print(f"wrote {target}")

"""`clbrdf view`: lobes in a window or a picture, or the page that computes."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal
from urllib.parse import urlencode

from cyclopts import Parameter

from clbrdf.cli.console import progress_bar, stderr_console
from clbrdf.cli.options import DeviceName, Overwrite, number_list
from clbrdf.errors import InputError
from clbrdf.opencl.device import choose_device
from clbrdf.storage.files import check_apart, check_output

if TYPE_CHECKING:
    from clbrdf.viz.panel import LobeRequest
    from clbrdf.viz.subject import Subject

Flag = Parameter(negative="")


def command(
    files: Annotated[list[Path], Parameter(negative_iterable="", consume_multiple=True)],
    /,
    *,
    png: Path | None = None,
    svg: Path | None = None,
    pdf: Path | None = None,
    csv: Path | None = None,
    gif: Path | None = None,
    mp4: Path | None = None,
    html: Path | None = None,
    serve: Annotated[bool, Flag] = False,
    host: str = "127.0.0.1",
    port: int = 8080,
    wavelength: str | None = None,
    theta_i: str | None = None,
    radius: Literal["linear", "log", "cosine"] = "linear",
    floor: float | None = None,
    colour: Literal["value", "spectrum"] = "value",
    points: bool = True,
    overlay: Annotated[bool, Flag] = False,
    difference: Annotated[bool, Flag] = False,
    size: str = "1200x900",
    transparent: Annotated[bool, Flag] = False,
    sweep: Literal["wavelength", "theta-i"] = "wavelength",
    frames: int | None = None,
    device: DeviceName = None,
    overwrite: Overwrite = False,
) -> None:
    """Show the BRDF over the hemisphere as lobes: the model of a fit, the measured values of a scan.

    Several files, wavelengths or incident angles stand side by side with one scale, or lie over each
    other with --overlay. Without --png, --svg, --pdf, --csv, --gif, --mp4, --html or --serve a window opens.

    --html and --serve give the page that computes, with maps, cuts and spectra beside the lobe; its own
    controls choose what is shown.

    Parameters
    ----------
    files
        scan or fit files
    png
        write a picture
    svg
        write the picture for print: words, key and captions scale
    pdf
        the same as PDF
    csv
        write the numbers behind the picture: measured directions, and the model over the hemisphere
    gif
        write a sweep over wavelength or incident angle
    mp4
        the same as a film
    html
        write one page that computes in a browser, without a server
    serve
        the same page at an address, until Ctrl-C
    host
        where --serve listens; anything but this machine needs the token that is printed
    port
        port of --serve; 0 takes a free one
    wavelength
        nm, one or a list; the nearest measured ones are shown
    theta_i
        incident zenith in degrees, one or a list
    radius
        what the radius means: the BRDF, its logarithm, or BRDF times cosine
    floor
        1/sr at the foot of a logarithmic radius
    colour
        colour by value, or the colour of the spectrum in daylight
    points
        draw measured points with whiskers to the model
    overlay
        all lobes in one picture
    difference
        of two files first minus second; of one fit, measured minus model
    size
        width x height, pixels
    transparent
        leave the background of --png out
    sweep
        what --gif and --mp4 run through
    frames
        how many stops a sweep has
    """
    from clbrdf.viz import graphics

    pixels = _size(size)
    named = {"png": png, "svg": svg, "pdf": pdf, "csv": csv, "gif": gif, "mp4": mp4, "html": html}
    outputs = [path for path in named.values() if path is not None]
    for kind, path in named.items():
        if path is not None and path.suffix.casefold() != f".{kind}":
            raise InputError(f"{path}: --{kind} writes .{kind} files; let the name end in it")
    check_apart(outputs, files)
    for path in outputs:
        check_output(path, overwrite)
    if transparent and png is None:
        raise InputError("--transparent belongs to --png FILE; films and pages have a background")
    if html is not None or serve:
        _check_page(wavelength, theta_i, overlay, difference, colour, floor)
    page = html is not None or serve
    if not outputs or outputs == [html]:
        if page:
            _page(files, html, serve, host, port, _start(wavelength, theta_i, radius), overwrite)
            return
        graphics.require_screen()
    requests = _requests(files, wavelength, theta_i, difference)
    from clbrdf.viz.style import LobeStyle

    look = LobeStyle(radius=radius, colour=colour, floor=floor, points=points)
    told = stderr_console()
    if csv is not None:
        from clbrdf.viz.values import save_values

        told.print(f"wrote {csv}: {save_values(requests, csv, overwrite)} rows", soft_wrap=True)
    if any(path not in (None, csv, html) for path in outputs):
        graphics.require_off_screen()
    elif outputs and not page:
        return
    chosen = choose_device(device) if any(r.subject.fit is not None for r in requests) else None
    for path in (svg, pdf):
        if path is not None:
            from clbrdf.viz.printed import save_printed

            save_printed(requests, look, path, pixels, overlay, chosen, overwrite)
            told.print(f"wrote {path}", soft_wrap=True)
    if any(path is not None for path in (png, gif, mp4)):
        from clbrdf.viz import stills
        from clbrdf.viz.picture import Picture

        picture = Picture(requests, look, size=pixels, overlay=overlay, device=chosen)
        if png is not None:
            stills.save_png(picture, png, transparent, overwrite)
            told.print(f"wrote {png}", soft_wrap=True)
        for film, save in ((gif, stills.save_gif), (mp4, stills.save_mp4)):
            if film is not None:
                with progress_bar(f"drawing {film.name}") as report:
                    stops = save(picture, film, sweep, frames, overwrite, report)
                told.print(f"wrote {film}: {stops} stops", soft_wrap=True)
        picture.close()
    if page:
        _page(files, html, serve, host, port, _start(wavelength, theta_i, radius), overwrite)
    elif not outputs:
        from clbrdf.viz.window import Window, controlled_picture

        Window(controlled_picture(requests, look, pixels, overlay=overlay, device=chosen)).show()


def _check_page(
    wavelength: str | None,
    theta_i: str | None,
    overlay: bool,
    difference: bool,
    colour: str,
    floor: float | None,
) -> None:
    """Raise InputError where something is asked for that the page has its own control for, or has not."""
    for name, given in (("--overlay", overlay), ("--difference", difference)):
        if given:
            raise InputError(
                f"{name} belongs to pictures and the window; the page has deviations, and ratios of files"
            )
    if colour != "value" or floor is not None:
        raise InputError("--colour and --floor belong to pictures and the window, not to --html or --serve")
    for name, text in (("--wavelength", wavelength), ("--theta-i", theta_i)):
        if text is not None and len(number_list(name, text)) > 1:
            raise InputError(f"{name} {text}: the page starts at one value and has a slider; give one")


def _start(wavelength: str | None, theta_i: str | None, radius: str) -> str:
    """Return what a page shows first, as its address says it."""
    words: list[tuple[str, object]] = []
    if wavelength is not None:
        words.append(("nm", float(wavelength)))
    if theta_i is not None:
        words += [("theta_i", float(theta_i)), ("theta_r", float(theta_i))]
    if radius == "cosine":
        words += [("scale", "ratio"), ("to", "cosine")]
    elif radius == "log":
        words.append(("scale", "log"))
    return urlencode(words)


def _page(
    files: list[Path], html: Path | None, serve: bool, host: str, port: int, start: str, overwrite: bool
) -> None:
    """Write the page that computes, serve it, or both."""
    from clbrdf.cli.report_command import write_page

    if html is not None:
        write_page(files, html, overwrite, start)
    if serve:
        from clbrdf.viz.page import open_for_page, page_text
        from clbrdf.viz.serve import PageServer

        text = page_text([open_for_page(path) for path in files], start)
        told = stderr_console()
        server = PageServer(text, host, port)
        server.run(lambda url: told.print(f"open {url}  (Ctrl-C ends)", soft_wrap=True))


def _size(text: str) -> tuple[int, int]:
    words = text.casefold().split("x")
    if len(words) != 2 or not all(word.strip().isdecimal() for word in words):
        raise InputError(f"--size {text!r}: write width x height in pixels, as in --size 1200x900")
    return int(words[0]), int(words[1])


def _requests(
    files: list[Path], wavelength: str | None, theta_i: str | None, difference: bool
) -> list[LobeRequest]:
    """Return what is shown: every file at every wavelength and incident angle asked for."""
    from clbrdf.viz.panel import LobeRequest, check_difference
    from clbrdf.viz.subject import named_apart, open_subject

    subjects = named_apart([open_subject(path) for path in files])
    subjects, minus = _difference(subjects) if difference else (subjects, None)
    first = subjects[0]
    waves = [first.default_wavelength()]
    if wavelength is not None:
        waves = [float(w) for w in number_list("--wavelength", wavelength)]
    angles = [first.default_incident()]
    if theta_i is not None:
        angles = [float(a) for a in number_list("--theta-i", theta_i)]
    for value in waves:
        for subject in subjects:
            subject.check_wavelength(value)
    for value in angles:
        if not 0.0 <= value <= 89.0:
            raise InputError(f"--theta-i {value:g}: incident angles that can be drawn lie between 0 and 89")
        for subject in subjects:
            subject.check_incident(value)
    requests = [LobeRequest(s, w, a, minus) for s, w, a in product(subjects, waves, angles)]
    for request in requests:
        check_difference(request)
    return requests


def _difference(subjects: list[Subject]) -> tuple[list[Subject], Subject]:
    """Return what is shown and what is subtracted."""
    if len(subjects) == 2 and subjects[0].fit is not None and subjects[1].fit is None:
        return subjects[1:], subjects[0]  # measured minus model, as for one fit
    if len(subjects) == 2:
        return subjects[:1], subjects[1]
    if len(subjects) == 1 and subjects[0].fit is not None:
        return subjects, subjects[0]
    raise InputError("--difference needs two files, or one fit (measured minus model)")

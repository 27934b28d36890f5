"""The running measurement in the terminal: the latest point's spectrum, its value, the time left."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import numpy.typing as npt

from clbrdf.cli.console import number, stderr_console
from clbrdf.rig.live import Snapshot

BLOCKS = " ▁▂▃▄▅▆▇█"
WIDTH = 60


@contextmanager
def live_view() -> Iterator[Callable[[Snapshot], None]]:
    """Give what shows a snapshot: in place on a terminal, a line for each point elsewhere."""
    console = stderr_console()
    if not console.is_terminal:
        yield lambda snapshot: console.print(snapshot_line(snapshot), highlight=False, soft_wrap=True)
        return
    from rich.live import Live as RichLive
    from rich.text import Text

    with RichLive(Text("waiting for the first point"), console=console, refresh_per_second=4) as display:
        yield lambda snapshot: display.update(Text(picture(snapshot)))


def snapshot_line(snapshot: Snapshot) -> str:
    """Return a snapshot as one line."""
    theta_i, phi_i, theta_r, phi_r = snapshot.row.nominal
    place = f"θi {theta_i:g}° θr {theta_r:g}° φ {(phi_r - phi_i) % 360.0:g}°"
    total = f"/{snapshot.total}" if snapshot.total else ""
    return f"{snapshot.done}{total}  {place}  {_value(snapshot)}  {_left(snapshot.remaining)}"


def picture(snapshot: Snapshot) -> str:
    """Return a snapshot as a few lines with the spectrum as blocks."""
    lines = [snapshot_line(snapshot)]
    if len(snapshot.brdf):
        first, last = snapshot.wavelength[0], snapshot.wavelength[-1]
        lines.append(f"  BRDF {spark(snapshot.brdf)}  {first:g} to {last:g} nm")
    row = snapshot.row
    lines.append(
        f"  {row.scans} × {row.integration_time:g} s, reference {number(row.reference_power)} W, {row.time}"
    )
    return "\n".join(lines)


def spark(values: npt.NDArray[np.float64], width: int = WIDTH) -> str:
    """Return values as a row of blocks from 0 to the largest, at most `width` of them; gaps stay empty."""
    parts = np.array_split(values, min(width, len(values)))
    heights = [float(np.nanmean(part)) if np.isfinite(part).any() else math.nan for part in parts]
    top = max((h for h in heights if math.isfinite(h)), default=0.0)
    if top <= 0.0:
        return " " * len(heights)
    steps = [0 if not math.isfinite(h) else round(max(0.0, h) / top * (len(BLOCKS) - 1)) for h in heights]
    return "".join(BLOCKS[step] for step in steps)


def _value(snapshot: Snapshot) -> str:
    good = np.isfinite(snapshot.brdf)
    if not good.any():
        return "skipped" if not len(snapshot.brdf) else "no measurement"
    middle = np.nonzero(good)[0][int(good.sum()) // 2]
    value, sigma = snapshot.brdf[middle], snapshot.sigma[middle]
    return f"{number(value)} ± {number(sigma, 2)} 1/sr at {snapshot.wavelength[middle]:g} nm"


def _left(seconds: float) -> str:
    if not math.isfinite(seconds):
        return ""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min left" if hours else f"{minutes} min {rest:02d} s left"

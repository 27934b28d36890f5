"""Parts of a page: headings, tables, figures that stand inside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from clbrdf.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """
 body { font: 15px/1.5 system-ui, sans-serif; color: #111; max-width: 1100px;
        margin: 2em auto; padding: 0 1em; }
 h1 { font-size: 24px; } h2 { font-size: 18px; margin-top: 2em; border-bottom: 1px solid #ccc; }
 img { max-width: 100%; height: auto; } figure { margin: 1em 0; } figcaption { color: #444; font-size: 14px; }
 table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
 td, th { padding: 2px 10px; text-align: right; border-bottom: 1px solid #e4e4e4; }
 th { border-bottom: 1px solid #888; } .words td, .words th { text-align: left; }
 .long { max-height: 420px; overflow: auto; } .warning { border-left: 4px solid #d55e00; padding-left: .8em; }
 @media print { .long { max-height: none; overflow: visible; } h2 { break-after: avoid; } }
"""


def section(title: str, content: str) -> str:
    """Return a heading and what stands under it."""
    return f"<h2>{escape(title)}</h2>\n{content}"


def pairs(rows: list[tuple[str, str]]) -> str:
    """Return names and values in words."""
    lines = "".join(f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in rows)
    return f'<table class="words">{lines}</table>'


def cell(value: float | str, digits: int) -> str:
    """Return a number in few characters, "" where it is not finite."""
    if isinstance(value, str):
        return value
    return f"{value:.{digits}g}" if np.isfinite(value) else ""


def table(names: Sequence[str], rows: Sequence[Sequence[float | str]]) -> str:
    """Return a table of numbers."""
    head = "".join(f"<th>{escape(name)}</th>" for name in names)
    cells = ((escape(cell(v, 5)) or "–" for v in row) for row in rows)
    body = "".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>" for row in cells)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def figure(draw: Callable[[], Figure], kind: str, caption: str) -> str:
    """Return a figure, or why it is not drawn."""
    try:
        drawn = draw()
    except InputError as error:
        return f"<p>Not drawn: {escape(str(error))}.</p>"
    out = io.BytesIO()
    drawn.savefig(out, format=kind, dpi=130)
    return image(out.getvalue(), "image/svg+xml" if kind == "svg" else "image/png", caption)


def image(data: bytes, kind: str, caption: str) -> str:
    """Return a picture inside the page."""
    text = base64.b64encode(data).decode("ascii")
    words = escape(caption)
    image = f'<img src="data:{kind};base64,{text}" alt="{words}">'
    return f"<figure>{image}<figcaption>{words}</figcaption></figure>"

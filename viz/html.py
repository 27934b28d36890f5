"""One self-contained page with lobes that turn in a browser, without a server and without the network.

The scene goes through trame's serialiser for vtk.js and into its offline viewer. That carries geometry
only, so the labels are flat shapes, and the title, the notes and the key are words of the page itself.
"""

from __future__ import annotations

import io
import json
import zipfile
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from clbrdf.errors import InputError
from clbrdf.files import whole_text
from clbrdf.viz.colour_bar import ValuePaint
from clbrdf.viz.panel import Panel
from clbrdf.viz.scene import Scene
from clbrdf.viz.style import DIFFERENCE_MAP, VALUE_MAP, colour_table

VIEWER_ICONS = "https://kitware.github.io/vtk-js/icon/favicon-${t}x${t}.png"
MISSING = "pages that turn need trame: pip install 'clbrdf[web]'"

STYLE = """<style>
 .content { position: absolute; left: 0; top: 0; width: 100%; height: 100%; }
 .words { position: absolute; left: 1em; top: .8em; z-index: 10; pointer-events: none; color: #111;
          font: 15px/1.35 system-ui, sans-serif; max-width: 80%; }
 .words h1 { font-size: 20px; margin: 0 0 .2em; } .words p { margin: 0 0 .5em; white-space: pre-line; }
 .key { position: absolute; right: 1em; top: 22%; z-index: 10; pointer-events: none; color: #111;
        font: 14px system-ui, sans-serif; text-align: right; }
 .bar { position: relative; width: 22px; height: 320px; margin: .6em 0 .6em auto; }
 .bar span { position: absolute; right: 28px; transform: translateY(50%); white-space: nowrap; }
 .swatch { display: inline-block; width: 22px; height: 12px; margin-left: .5em; }
 .caption { position: absolute; z-index: 10; pointer-events: none; color: #111; white-space: pre-line;
            font: 14px/1.35 system-ui, sans-serif; }
</style>
"""


def scene_archive(scene: Scene) -> bytes:
    """Return the scene as vtk.js' offline viewer takes it.

    Raises
    ------
    InputError
        trame is not installed.
    """
    try:
        from trame_vtk.modules.vtk.serializers import (
            SynchronizationContext,
            extract_array_hash,
            initialize_serializers,
            reference_id,
            serialize,
        )
    except ImportError:
        raise InputError(MISSING) from None
    initialize_serializers()
    window = scene.plotter.render_window
    scene.render()
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    description = serialize(None, window, reference_id(window), context, 0)
    if description is None:
        raise InputError("the scene could not be written for a browser; write a picture with --png FILE")
    _keep_projection(description, scene)
    description["extra"] = {"centerOfRotation": list(scene.view.centre), "vtkRefId": description["id"]}
    hashes = {}
    for entry in extract_array_hash(description):
        name = entry.get("hash")
        hashes[name] = {**entry, "content": context.get_cached_data_array(name, False)}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps({"scene": description, "hashes": hashes}))
    return packed.getvalue()


def _keep_projection(description: dict[str, Any], scene: Scene) -> None:
    """Say that cameras project in parallel, which the serialiser leaves out."""
    properties = description.get("properties", {})
    if "focalPoint" in properties:
        scale = scene.panels[0].renderer.GetActiveCamera().GetParallelScale()
        properties.update({"parallelProjection": True, "parallelScale": scale})
    for dependency in description.get("dependencies", []):
        _keep_projection(dependency, scene)


def _bar(paint: ValuePaint, title: str) -> str:
    table = colour_table(DIFFERENCE_MAP if paint.signed else VALUE_MAP)
    stops = ", ".join("#{:02x}{:02x}{:02x}".format(*table[k]) for k in np.linspace(0, 255, 17).astype(int))
    ticks = "".join(f'<span style="bottom:{100.0 * at:.1f}%">{escape(t)} –</span>' for at, t in paint.ticks())
    words = escape(title).replace("\n", "<br>")
    return (
        f'<div class="key">{words}<div class="bar" style="background:linear-gradient(to top, {stops})">'
        f"{ticks}</div></div>"
    )


def words_of(scene: Scene) -> str:
    """Return title, notes, captions and key of a scene as HTML."""
    entries = [e for p in scene.panels for e in p.entries]
    title = escape(scene.title)
    notes = escape("\n".join(scene.notes()))
    if len(scene.panels) == 1:
        notes = escape(scene.panels[0].caption()) + "\n" + notes
    parts = [f'<div class="words"><h1>{title}</h1><p>{notes}\nDrag to turn, wheel to zoom.</p></div>']
    if len(scene.panels) > 1:
        for panel, (x, y, _, _) in zip(scene.panels, scene.corners, strict=True):
            where = f"left:{100.0 * x:.1f}%;top:{100.0 * (1.0 - y):.1f}%"
            parts.append(f'<div class="caption" style="{where}">{escape(panel.caption(scene.named))}</div>')
    if scene.overlay:
        rows = "<br>".join(
            f'{escape(scene.overlay_name(e))}<span class="swatch" style="background:{colour}"></span>'
            for e, colour in ((e, Panel.colour_of(k)) for k, e in enumerate(entries))
        )
        parts.append(f'<div class="key">{rows}</div>')
    elif scene.look.colour == "spectrum":
        parts.append('<div class="key">colour: hue of the spectrum<br>in daylight D65</div>')
    elif scene.paint is not None:
        parts.append(_bar(scene.paint, scene.key_title))
    return "\n".join(parts)


def page_text(scene: Scene) -> str:
    """Return the page of a scene made with ``flat_labels`` and without words.

    Raises
    ------
    InputError
        trame is not installed.
    """
    archive = scene_archive(scene)
    from trame_vtk.tools.vtksz2html import write_html

    page = io.StringIO()
    write_html(archive, page)
    text = page.getvalue()
    name = escape(scene.title)
    text = text.replace(
        "<title>VTK.js | Example - OfflineLocalView</title>", f"<title>{name}: BRDF</title>", 1
    )
    text = text.replace("</head>", STYLE + '<link rel="icon" href="data:,">\n</head>', 1)
    # The viewer would fetch its icons from its maker's site.
    text = text.replace(VIEWER_ICONS, "data:,")
    return _before_end(text, words_of(scene))


def _before_end(text: str, words: str) -> str:
    head, end, tail = text.rpartition("</body>")
    # The viewer empties the element it draws in, so it gets one of its own.
    head = head.replace("<body>", '<body>\n<div class="content"></div>', 1)
    return f"{head}{words}\n{end}{tail}"


def save_html(scene: Any, path: str | Path, overwrite: bool = False) -> None:
    """Write the page of a scene, whole or not at all.

    Raises
    ------
    InputError
        trame is not installed, or the file exists or cannot be written.
    """
    whole_text(path, page_text(scene), overwrite)

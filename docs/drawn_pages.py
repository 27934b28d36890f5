"""Pages that follow from the package: one for each model, the list of formats, the picture of the angles.

They are written before each build into `docs/drawn/`, which git does not keep, so that they cannot differ
from what the program does.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

from clbrdf.cli.models_command import KINDS, MEANINGS
from clbrdf.formats.registry import formats
from clbrdf.models import Model, get_model, model_names

DRAWN = Path(__file__).parent / "drawn"


def setup(app: Any) -> dict[str, Any]:
    """Have the pages drawn before Sphinx looks for them."""
    app.connect("builder-inited", lambda _: draw())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def draw() -> None:
    """Write every page."""
    shutil.rmtree(DRAWN, ignore_errors=True)
    (DRAWN / "models").mkdir(parents=True)
    for name in model_names():
        (DRAWN / "models" / f"{name}.md").write_text(model_page(get_model(name)), encoding="utf-8")
    (DRAWN / "formats.md").write_text(format_table(), encoding="utf-8")
    draw_angles(DRAWN / "angles.svg")


def model_page(model: Model) -> str:
    """Return the page of a model: table, promises, source, and the formula as the package has it."""
    lines = [f"# {model.name}", "", f"{model.title}.", "", f"**Source:** {model.source}", ""]
    lines += ["| parameter | unit | default | limits | meaning |", "|---|---|---|---|---|"]
    for row in model.parameters:
        if row.given:
            default, limits = ("to be fixed" if row.given == "user" else "the wavelength"), ""
        else:
            default, limits = f"{row.default:g}", f"{row.bounds[0]:g} to {row.bounds[1]:g}"
        lines.append(f"| `{row.name}` | {row.unit} | {default} | {limits} | {row.meaning} |")
    kind = KINDS.get(model.kind, model.kind).format(model.name)
    promises = [meaning for flag, meaning in MEANINGS.items() if flag in model.flags]
    lines += ["", f"It is {kind}.", ""]
    lines += [f"- {text}" for text in promises]
    file = f"../../../clbrdf/models/library/{model.name}.py"
    lines += [
        "",
        "## The whole page in the package",
        "",
        f"```{{literalinclude}} {file}",
        ":language: python",
        "```",
    ]
    return "\n".join(lines) + "\n"


def format_table() -> str:
    """Return the table of formats, to be included."""
    lines = ["| `--format` | what it is | ending | written |", "|---|---|---|---|"]
    for entry in formats().values():
        written = (entry.holds or "yes") if entry.write else "no"
        lines.append(f"| `{entry.name}` | {entry.title} | {' '.join(entry.endings)} | {written} |")
    return "\n".join(lines) + "\n"


def draw_angles(path: Path) -> None:
    """Draw the plane of incidence: source, mirror direction, view, normal, and γ."""
    mpl.rcParams.update({"svg.fonttype": "none", "font.size": 11})
    figure, axes = plt.subplots(figsize=(6.4, 3.6))
    theta_i, theta_r = np.radians(45.0), np.radians(20.0)

    def ray(angle: float, colour: str, text: str, towards: bool) -> None:
        x, y = np.sin(angle), np.cos(angle)
        start, end = ((x, y), (0, 0)) if towards else ((0, 0), (x, y))
        axes.annotate(
            "", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2, "shrinkB": 0}
        )
        axes.text(1.06 * x, 1.06 * y, text, color=colour, ha="center", va="bottom")

    ray(-theta_i, "#b35900", "source", True)
    ray(theta_i, "#888888", "mirror direction", False)
    ray(theta_r, "#0b5fa5", "view", False)
    axes.plot([0, 0], [0, 1.12], color="black", lw=1, ls=(0, (5, 3)))
    axes.text(0, 1.14, "normal", ha="center")
    axes.plot([-1.1, 1.1], [0, 0], color="black", lw=2)
    for low, high, radius, text in (
        (-theta_i, 0.0, 0.35, "θi"),
        (0.0, theta_r, 0.55, "θr"),
        (theta_r, theta_i, 0.75, "2γ"),
    ):
        arc = np.linspace(low, high, 40)
        axes.plot(radius * np.sin(arc), radius * np.cos(arc), color="black", lw=1)
        middle = 0.5 * (low + high)
        axes.text(
            (radius + 0.07) * np.sin(middle), (radius + 0.07) * np.cos(middle), text, ha="center", va="center"
        )
    axes.text(-0.72, -0.12, "φ = 0°: the source's half-plane", ha="center")
    axes.text(0.72, -0.12, "φ = 180°: forward", ha="center")
    axes.set(xlim=(-1.35, 1.35), ylim=(-0.2, 1.25), aspect="equal")
    axes.axis("off")
    figure.savefig(path, bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)

"""Whether pictures can be drawn here: a display for windows, some OpenGL for everything else.

VTK ends the process where its OpenGL library fails, so another process tries first, once.
"""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

from clbrdf.errors import ClbrdfError, advice

SWITCH = "VTK_DEFAULT_OPENGL_WINDOW"
"""VTK's own environment variable: which kind of window it makes."""

OFF_SCREEN = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")

TRIAL = """
import sys
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderWindow, vtkRenderer
window, renderer = vtkRenderWindow(), vtkRenderer()
window.SetOffScreenRendering(int(sys.argv[1]))
window.SetSize(16, 16)
renderer.SetBackground(1.0, 0.0, 0.0)
window.AddRenderer(renderer)
window.Render()
pixel = vtkUnsignedCharArray()
window.GetPixelData(8, 8, 8, 8, 1, pixel, 0)
print(window.GetClassName() if pixel.GetValue(0) == 255 else "")
"""


class GraphicsError(ClbrdfError, RuntimeError):
    """No display, or no OpenGL library, where a picture was asked for."""


def _trial(kind: str, off_screen: bool) -> str:
    """Return the class of window that worked in another process, "" if none did."""
    environment = {**os.environ, **({SWITCH: kind} if kind else {})}
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", TRIAL, str(int(off_screen))],
            env=environment,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


@cache
def off_screen_kind() -> str | None:
    """Return the value of VTK's switch that draws without a screen here; "" is VTK's own choice."""
    there = os.environ.get(SWITCH)
    own = [there] if there else [""] if has_display() else []
    return next((kind for kind in (*own, *OFF_SCREEN) if _trial(kind, True)), None)


def has_display() -> bool:
    """Whether a screen is announced; it may still not answer."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def require_off_screen() -> None:
    """Prepare VTK for pictures without a screen; called before VTK is loaded.

    Raises
    ------
    GraphicsError
        There is no OpenGL library that works.
    """
    kind = off_screen_kind()
    if kind is None:
        raise GraphicsError(
            "no OpenGL library works here; install one (Debian, Ubuntu: apt-get install libegl1"
            " libgl1-mesa-dri), or draw on another machine"
        )
    if kind:
        os.environ.setdefault(SWITCH, kind)


@cache
def _screen_answers() -> bool:
    return has_display() and _trial("", False) not in ("", *OFF_SCREEN)


def require_screen() -> None:
    """Make sure that a window can open.

    Raises
    ------
    GraphicsError
        There is no display, or it does not answer.
    """
    if not _screen_answers():
        others = advice(
            "write a picture with save_png or a page with save_page",
            "write a picture with --png FILE or a page with --html FILE, or look at it in a browser with"
            " --serve",
        )
        raise GraphicsError(f"no display for a window here; {others}")

"""No display, no OpenGL: one clear line."""

from __future__ import annotations

import subprocess
import sys

import pytest

from clbrdf.errors import ON_COMMAND_LINE
from clbrdf.viz import graphics
from tests.viz.test_report import without_graphics


@pytest.fixture(autouse=True)
def fresh():
    yield
    graphics.off_screen_kind.cache_clear()
    graphics._screen_answers.cache_clear()


def test_no_display(monkeypatch):
    graphics._screen_answers.cache_clear()
    monkeypatch.setattr(graphics.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(graphics.GraphicsError, match=r"no display .* save_png .* save_page"):
        graphics.require_screen()
    token = ON_COMMAND_LINE.set(True)
    try:
        with pytest.raises(
            graphics.GraphicsError, match=r"no display .* --png FILE .* --html FILE, .* --serve"
        ):
            graphics.require_screen()
    finally:
        ON_COMMAND_LINE.reset(token)


def test_a_display_that_does_not_answer(monkeypatch):
    graphics._screen_answers.cache_clear()
    monkeypatch.setenv("DISPLAY", ":987")
    with pytest.raises(graphics.GraphicsError, match="no display for a window here"):
        graphics.require_screen()


def test_no_opengl(monkeypatch):
    without_graphics(monkeypatch)
    with pytest.raises(graphics.GraphicsError, match="no OpenGL library works here; install one"):
        graphics.require_off_screen()


def test_a_trial_that_fails_is_no_crash_here():
    assert graphics._trial("vtkNoSuchWindow", True) in ("", "vtkOSOpenGLRenderWindow", "vtkEGLRenderWindow")


def test_the_package_of_pictures_loads_nothing_heavy():
    code = (
        "import sys, clbrdf.viz;"
        "heavy = {'vtkmodules', 'pyvista', 'matplotlib', 'pyopencl', 'PIL'} & set(sys.modules);"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)

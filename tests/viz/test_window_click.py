"""A click of a real pointer in a real window, on a screen without a monitor."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time

import pytest

WINDOW = """
import sys
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.style import LobeStyle
from clbrdf.viz.subject import open_subject
from clbrdf.viz.window import Window, controlled_picture
from tests.viz.test_control import project

request = LobeRequest(open_subject(sys.argv[1]), 550.0, 45.0)
control = controlled_picture([request], LobeStyle(radius="log"), (700, 600))
window = Window(control)
panel = control.picture.panels[0]
pick = control.pick

def told(x, y):
    pick(x, y)
    print("told", control.message, flush=True)

control.pick = told
window.interactor.CreateRepeatingTimer(200)

def ready(caller, event):
    window.interactor.RemoveObserver(observer)
    x, y = (int(v) for v in project(panel.renderer, panel.marks[0].positions)[9])
    print("ready", x, control.picture.plotter.render_window.GetSize()[1] - 1 - y, flush=True)

observer = window.interactor.AddObserver("TimerEvent", ready)
window.show()
"""


@pytest.fixture
def screen():
    """The number of a display of its own."""
    if shutil.which("Xvfb") is None or shutil.which("xdotool") is None:
        pytest.skip("no Xvfb with xdotool here (Debian: apt-get install xvfb xdotool)")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "900x800x24"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait()


def test_a_click_of_the_mouse_tells_the_point(screen, foil_file):
    # What a test before this one has settled on for pictures without a screen is no window.
    settled = ("VTK_DEFAULT_OPENGL_WINDOW", "PYVISTA_OFF_SCREEN")
    env = {name: value for name, value in os.environ.items() if name not in settled}
    env |= {"DISPLAY": screen, "PYTHONPATH": os.getcwd()}
    with subprocess.Popen(
        [sys.executable, "-c", WINDOW, str(foil_file)], stdout=subprocess.PIPE, text=True, env=env
    ) as process:
        patience = threading.Timer(300.0, process.kill)  # a click that does not arrive says nothing
        patience.start()
        try:
            word, x, y = process.stdout.readline().split()
            assert word == "ready"
            time.sleep(0.5)
            for words in (("mousemove", x, y), ("mousedown", "1"), ("mouseup", "1")):
                subprocess.run(["xdotool", *words], env=env, check=True, timeout=20)
                time.sleep(0.3)
            line = process.stdout.readline()
            assert line.startswith("told foil: θr = ")
            assert "measured" in line
        finally:
            patience.cancel()
            process.kill()

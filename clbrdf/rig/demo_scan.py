"""The measurement with which `make demo` begins: an emulated rig measures the yellow tin foil of `scans/`."""

from __future__ import annotations

from pathlib import Path

from clbrdf.parallel.ending import scratch_folder
from clbrdf.progress import Report, silent
from clbrdf.rig.budget import load_budget
from clbrdf.rig.emulator.rig import EmulatedRig
from clbrdf.rig.measure import measure
from clbrdf.rig.rigfile import load_rig
from clbrdf.rig.samples import sample_path
from clbrdf.scans import sample_scene
from clbrdf.scene.scenefile import load_scene

DEMO_PLAN = """
sample = "yellow tin foil (emulated)"
theta_i = [30, 45, 60]
theta_r = { start = 0, stop = 85, step = 2.5 }
phi_r = [180]
reference_every = 120
longest_time = 1.0
wavelength = { start = 380, stop = 760, step = 5 }
"""

FASTER = (("time_factor = 20 ", "time_factor = 400 "), ("line_speed = true ", "line_speed = false "))
"""What the demo changes in the sample rig file."""


def measure_demo_scan(path: str | Path, report: Report = silent, overwrite: bool = False) -> Path:
    """Measure yellow tin foil on an emulated rig over pseudo-terminals; return the scan's path.

    The foil is that of `scans/yellow_tin_foil.toml`: Table 1 of the paper at 570 nm, yellow beside it.
    The same bytes travel as with real instruments, faster: the rig's time runs 400 times faster than
    ours and the lines have no speed limit. About 10 s.

    Raises
    ------
    InputError
        The file exists and `overwrite` is False, or cannot be written.
    """
    target = Path(path)
    with scratch_folder() as folder:
        text = sample_path("rig.toml").read_text(encoding="utf-8")
        for before, after in FASTER:
            assert before in text
            text = text.replace(before, after)
        rig_file, plan_file = folder / "rig.toml", folder / "plan.toml"
        rig_file.write_text(text, encoding="utf-8")
        plan_file.write_text(DEMO_PLAN, encoding="utf-8")
        budget = load_budget(sample_path("budget.toml"))
        rig = load_rig(rig_file)
        assert rig.emulator is not None
        surface = load_scene(sample_scene("yellow_tin_foil")).surface
        emulator = rig.emulator.model_copy(update={"model": surface.model, "parameters": surface.parameters})
        with EmulatedRig(rig.model_copy(update={"emulator": emulator})):
            measure(plan_file, rig_file, target, budget=budget, report=report, overwrite=overwrite)
    return target

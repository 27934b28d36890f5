"""Time and memory over the size of a scan: what is measured, and what is drawn."""

from __future__ import annotations

import numpy as np

from clbrdf.bench.scaling import FEW, MERL, USUAL, ScalingPoint, fit_in_child, scaling_scan
from clbrdf.bench.scaling_figure import scaling_figure
from clbrdf.opencl.device import choose_device


def test_a_fit_in_a_process_of_its_own_tells_time_memory_and_excess():
    point = fit_in_child(300, 2, "ggx+lambert", choose_device())
    assert point.seconds > 0.0
    assert 0.0 < point.each < 1e9
    assert 50e6 < point.peak < 2e9  # the interpreter with NumPy and OpenCL at least
    assert point.excess <= 1e-6


def test_a_scan_as_merl_has_an_incident_direction_for_each():
    assert len(np.unique(scaling_scan(500, MERL[1], "ggx+lambert").theta_i)) == 500
    assert len(np.unique(scaling_scan(500, FEW, "wang2013").theta_i)) == 6


def test_the_figure_shows_both_sides():
    sizes = [(100, FEW), (1000, FEW), (USUAL, 16), (USUAL, 64)]
    points = [ScalingPoint("wang2013", n, w, 1.0, 1.5, 2e8, 0.0) for n, w in sizes]
    axes = scaling_figure(
        [*points, ScalingPoint(MERL[2], MERL[0], MERL[1], 5.0, 9.0, 7e8, np.nan)], "a device"
    ).axes
    assert axes[0].lines[0].get_xdata().tolist() == [100, 1000]
    assert axes[1].lines[0].get_xdata().tolist() == [16, 64]
    assert axes[2].lines[0].get_ydata().tolist() == [0.2, 0.2]

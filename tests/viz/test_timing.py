"""The measurement of slider steps measures; how fast they are is told by the benchmarks."""

from __future__ import annotations

import numpy as np
import pytest

from clbrdf.viz.timing import mesh_of, step_times


@pytest.mark.parametrize("points", [1000, 100_000])
def test_meshes_have_about_the_size_asked_for(points):
    assert mesh_of(points, 0.1, 85.0).size == pytest.approx(points, rel=0.05)


def test_both_sliders_are_timed(gl, foil):
    rows = step_times(foil, points=2000, size=(300, 240), steps=3)
    assert [row.slider for row in rows] == ["wavelength", "theta-i"]
    for row in rows:
        assert np.isfinite([row.lobe, row.update, row.redraw]).all()
        assert 0.0 < row.lobe < row.redraw

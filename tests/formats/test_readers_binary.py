"""Binary files written by hand: UTIA and MERL."""

from __future__ import annotations

import math
import time
import tracemalloc

import numpy as np
import pytest

from clbrdf import InputError
from clbrdf.formats import merl, utia
from clbrdf.formats.guard import Options
from clbrdf.formats.load import load_one
from clbrdf.formats.vectors import (
    from_half_difference,
)
from tests.formats import made_files as made
from tests.formats.made_files import F


def test_utia(text):
    scan = load_one([text(made.utia())], options=Options(scale="1"))
    assert scan.brdf.shape == (288 * 288, 3)
    assert scan.bands == ("R", "G", "B")
    # The file runs over view azimuths fastest.
    first = utia.read(text(made.utia()))[0]
    assert first.phi_r[:3].tolist() == [0.0, 7.5, 15.0]
    assert first.theta_r[48] == 15.0


@pytest.fixture(scope="module")
def merl_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("merl") / "made.binary"
    path.write_bytes(made.merl())
    return path


class TestMerl:
    def test_values_and_directions(self, merl_file):
        scan = load_one([merl_file])
        assert scan.bands == ("R", "G", "B")
        assert scan.brdf == pytest.approx(F)
        assert scan.theta_i.max() < 90.0
        assert scan.theta_r.max() < 90.0

    def test_a_cell_against_vectors(self):
        # θh = 10°, θd = 40°, φd = 90°: h = (sin 10, 0, cos 10), d = (0, sin 40, cos 40) turned 10° about y.
        h, d = math.radians(10.0), math.radians(40.0)
        source = np.array([math.sin(h) * math.cos(d), math.sin(d), math.cos(h) * math.cos(d)])
        half = np.array([math.sin(h), 0.0, math.cos(h)])
        view = 2.0 * (source @ half) * half - source
        theta_i, theta_r, phi = from_half_difference(np.array([10.0]), np.array([40.0]), np.array([90.0]))
        assert theta_i[0] == pytest.approx(math.degrees(math.acos(source[2])))
        assert theta_r[0] == pytest.approx(math.degrees(math.acos(view[2])))
        turn = math.degrees(math.atan2(view[1], view[0]) - math.atan2(source[1], source[0])) % 360.0
        assert phi[0] == pytest.approx(turn)

    def test_35_megabytes_quickly_and_in_little_memory(self, merl_file):
        start = time.process_time()
        merl.read(merl_file)
        seconds = time.process_time() - start
        tracemalloc.start()
        load_one([merl_file])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        # Processor time; 1 s is usual, and neighbours on a busy machine slow the memory.
        assert seconds < 3.0
        assert peak < 5 * merl_file.stat().st_size

    def test_a_cut_file_is_refused(self, merl_file, tmp_path):
        cut = tmp_path / "cut.binary"
        cut.write_bytes(merl_file.read_bytes()[:-8])
        with pytest.raises(InputError, match=r"has 34992004 bytes, and 34992012 are needed"):
            load_one([cut])

"""Thousands of points with every fault at random: no wrong value, each fault in the log, nothing hangs."""

import time
from bisect import bisect_left, bisect_right
from collections import Counter
from datetime import datetime, timedelta

import numpy as np
import pytest
from rig_helpers import emulation, write_plan
from test_rig_measure import model_values, quantisation_bound

from clbrdf.rig.budget import POINTS_ONLY
from clbrdf.rig.emulator.faults import FAULTS
from clbrdf.rig.measure import measure
from clbrdf.rig.rawscan import read_raw
from clbrdf.rig.transport import SerialLine
from clbrdf.scan import Scan

SLACK = 2.0
"""What the operating system may add to a deadline on a busy machine, s."""


@pytest.fixture
def late(monkeypatch):
    """How long after its deadline a read came back, at worst."""
    worst = [0.0]
    receive = SerialLine.receive

    def timed(self, deadline):
        try:
            return receive(self, deadline)
        finally:
            worst[0] = max(worst[0], time.monotonic() - deadline)

    monkeypatch.setattr(SerialLine, "receive", timed)
    return worst


def soak(tmp_path, late, step, repeats, rate, seed):
    plan = write_plan(
        tmp_path,
        step=step,
        dark_every=60,
        reference_every=300,
        more=f"repeats = {repeats}\nlongest_time = 0.5",
    )
    options = {"fault_rate": rate, "seed": seed, "attempts": 60, "patience": 0.08}
    events, moments = [], []
    with emulation(tmp_path, **options) as (rig_path, _, emulated):
        began = time.monotonic()
        measure(
            plan,
            rig_path,
            tmp_path / "scan.h5",
            budget=POINTS_ONLY,
            show=events.append,
            report=lambda done, total: moments.append(time.monotonic()),
        )
        seconds = time.monotonic() - began
        injected, exchanges = list(emulated.injector.injected), emulated.exchanges
    scan, raw = Scan.open(tmp_path / "scan.h5"), read_raw(tmp_path / "scan.h5")
    check_values(scan, raw, injected)
    silent, missed = unlogged(injected, events)
    counts = Counter(i.fault for i in injected)
    print(
        f"{len(scan.theta_r)} points in {seconds:.0f} s, {exchanges} exchanges,"
        f" {len(injected)} faults ({len(injected) / exchanges:.2%}), {len(events)} events,"
        f" {len(silent) - len(missed)} faults share the event of the next, {len(missed)} without any,"
        f" longest point {max(np.diff(moments)):.1f} s,"
        f" latest read {late[0]:.2f} s after its deadline"
    )
    print(dict(counts))
    assert late[0] < SLACK
    return scan, injected, exchanges, silent, missed


def check_values(scan, raw, injected):
    """No wrong value: each one is the model's within quantisation, or flagged as skipped."""
    measured = ~scan.mask.any(axis=1)
    assert np.count_nonzero(~measured) <= sum(i.fault == "limit_switch" for i in injected)
    assert set(scan.flag_counts()) <= {"not_measured", "limit_switch"}
    assert scan.theta_r[measured] == pytest.approx(raw.directions.theta_r[measured], abs=2e-4)
    assert scan.theta_i[measured] == pytest.approx(raw.directions.theta_i[measured], abs=2e-4)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.abs(scan.brdf - model_values(scan))
        bound = quantisation_bound(raw, scan)
    assert (error <= bound)[measured].all()


def unlogged(injected, events):
    """Faults after which the log has no event before the instrument's next fault; those with none at all.

    Of the first most are overlaps: a second fault came before the first one could show, and one event tells
    of both. The others have no event within 5 s.
    """
    events = sorted(events, key=lambda event: event.time)
    times = [datetime.fromisoformat(event.time) for event in events]
    silent, missed = [], []
    for k, fault in enumerate(injected):
        start = datetime.fromisoformat(fault.time)
        later = [i for i in injected[k + 1 : k + 200] if i.instrument == fault.instrument]
        last = start + timedelta(seconds=5.0)
        end = min([last, *(datetime.fromisoformat(i.time) + timedelta(seconds=0.002) for i in later[:1])])
        where = (fault.instrument, "rig")
        window = range(bisect_left(times, start - timedelta(seconds=0.002)), bisect_right(times, last))
        told = [times[n] for n in window if events[n].where in where]
        if not any(time <= end for time in told):
            silent.append(fault)
            if not told:
                missed.append(fault)
    return silent, missed


def test_soak_in_small(tmp_path, late):
    scan, injected, exchanges, silent, missed = soak(tmp_path, late, step=4.0, repeats=2, rate=0.012, seed=21)
    assert len(scan.theta_r) == 64
    assert len(injected) >= 0.01 * exchanges * 0.5
    assert len(silent) <= 0.1 * len(injected), silent
    assert len(missed) <= 1, missed


@pytest.mark.soak
def test_soak_10_000_points(tmp_path, late):
    scan, injected, exchanges, silent, missed = soak(
        tmp_path, late, step=0.5, repeats=42, rate=0.0135, seed=22
    )
    assert len(scan.theta_r) >= 10_000
    assert len(injected) >= 0.01 * exchanges
    names = {(i.instrument, i.fault) for i in injected}
    assert names == {(instrument, fault) for instrument, faults in FAULTS.items() for fault in faults}
    assert len(silent) <= 0.02 * len(injected), silent[:20]
    # A digit lost from the meter's status can leave a number that is as good: 16 for 160.
    assert len(missed) <= 1e-3 * len(injected), missed

"""Drivers against instruments written from the manuals' words: faults that an emulator of ours forgave."""

import time

import numpy as np
import pytest
from by_the_manual import Meter1830C, Smc100, Sts
from wire import PATIENCE

from clbrdf.rig.connection import Context
from clbrdf.rig.drivers.newport1830c import Newport1830C
from clbrdf.rig.drivers.obp import ObpSpectrometer
from clbrdf.rig.errors import StalledError
from clbrdf.rig.eventlog import EventLog
from clbrdf.rig.exposure import Exposer
from clbrdf.rig.motion import make_stages
from clbrdf.rig.rigfile import SpectrometerSettings, rig_class
from clbrdf.rig.transport import SerialLine


def line_to(peer, reply_time=0.1, patience=PATIENCE):
    line = SerialLine("device", peer.port, 115200, patience, reply_time, EventLog())
    line.open()
    return line


def meter_on(peer):
    meter = Newport1830C(line_to(peer))
    assert meter.identify().startswith("1830-C")
    meter.configure(550.0, 0.001)
    return meter


def test_meter_is_told_nothing_that_its_manual_does_not_list():
    with Meter1830C() as peer:
        assert meter_on(peer).measure_power() == 1e-3
        assert peer.refused == []
        assert peer.error_bits == 0
        assert "C" in peer.heard


@pytest.mark.parametrize(
    "left",
    [{}, {"G": 0}, {"Z": 1}, {"R": 3}, {"F": 1}, {"A": 1, "U": 3, "E": 0}, {"G": 0, "Z": 1, "R": 2, "F": 1}],
)
def test_meter_left_in_any_state(left):
    """Hold, a zero offset, a fixed range too small for the light, the slow filter."""
    with Meter1830C(**left) as peer:
        assert meter_on(peer).measure_power() == pytest.approx(1e-3, rel=1e-4)
        assert {code: peer.set[code] for code in "AEFGRUZ"} == dict(
            zip("AEFGRUZ", (0, 0, 3, 1, 0, 1, 0), strict=True)
        )


def test_meter_follows_a_drifting_lamp():
    """Left in hold or with the slow filter, the readings of a lamp that fades would lag behind."""
    with Meter1830C(lambda seconds: 1e-3 * np.exp(-0.2 * seconds), G=0, F=1) as peer:
        meter = meter_on(peer)
        time.sleep(0.3)
        before = peer.power(time.monotonic() - peer.began)
        power = meter.measure_power()
        after = peer.power(time.monotonic() - peer.began)
        # One conversion takes 20 ms, in which the lamp loses 0.4 %.
        assert after * (1 - 0.005) <= power <= before * (1 + 0.005)


def test_three_readings_are_three():
    """With `C` and "read done" no reading is told twice, however fast it is asked for."""
    readings = iter(range(10_000))
    with Meter1830C(lambda seconds: 1e-3 + 1e-6 * next(readings)) as peer:
        meter = meter_on(peer)
        told = [meter._new_reading() for _ in range(6)]
        assert len(set(told)) == 6


def stages_on(peer, **more):
    content = {
        "stages": {
            "port": peer.port,
            "patience": PATIENCE,
            "reply_time": 0.1,
            "poll": 0.001,
            "move_time": PATIENCE,
            **{
                name: {"address": k, "limits": [-170, 170]}
                for k, name in enumerate(("lamp", "turn", "pitch"), start=1)
            },
            **more,
        },
        "spectrometer": {"port": "b"},
        "reference": {"port": "c"},
        "geometry": {"solid_angle": 1e-3, "direct": [170, 90, 0]},
    }
    rig = rig_class(content).model_validate(content)
    stages = make_stages(rig.stages, Context("stages", EventLog()), lambda: None)
    stages.open()
    return stages


@pytest.mark.parametrize("offset", [0.0, 0.00003, -0.0001, 0.0009])
def test_an_axis_that_stays_within_rounding(offset):
    """The controller reads 10.00003 where 10 was asked for: the next move to 10 asks for no time of 0."""
    with Smc100(offset=offset) as peer:
        stages = stages_on(peer)
        stages.home()
        for target in ((10.0, 0.0, 5.0), (10.0, 20.0, 5.0), (10.0, 20.0, 5.0)):
            assert stages.move(target) == pytest.approx(target, abs=0.0011)
        assert peer.refused == []
        assert not any("PT" in request for request in peer.heard)


def test_a_servo_that_hunts():
    """Plus and minus two counts of 0.0005°, at every reading another."""
    with Smc100(hunting=2) as peer:
        stages = stages_on(peer, tolerance=0.004)
        stages.home()
        for lamp in (10.0, 20.0, 30.0):
            assert stages.move((lamp, 0.0, 0.0))[0] == pytest.approx(lamp, abs=0.004)
        assert peer.refused == []
        assert [event.kind for event in stages.log.events] == []


def test_a_latched_stall_is_not_lost_with_its_reply():
    """The following error is told once, and that reply is lost; the position alone shows nothing."""
    with Smc100() as peer:
        stages = stages_on(peer, patience=0.3)
        stages.home()
        peer.stall = True
        lost = []

        def lose(request):
            if request == "1TS" and not lost and peer.heard[-2].startswith("3T"):
                lost.append(request)
            return lost == [request] and len(lost) == 1 and not lost.append("done")

        peer.lose = lose
        with pytest.raises(StalledError, match="lost"):
            stages.move((10.0, 0.0, 0.0))
        assert lost


def test_axes_home_one_after_the_other():
    with Smc100() as peer:
        stages = stages_on(peer, homing_order=["pitch", "lamp", "turn"])
        stages.home()
        assert peer.homing == [(3, []), (1, []), (2, [])], "none begins while another is on its way"
        assert peer.refused == []


class Quiet:
    """Settings for an STS without noise."""

    settings = SpectrometerSettings(read_noise=0.5, shutter_time=0.0)


def exposer_on(peer, settings=Quiet.settings, seconds=0.01):
    spectrometer = ObpSpectrometer(line_to(peer))
    assert spectrometer.identify() == "S99"
    return Exposer(spectrometer, settings, (seconds,), 1, slice(0, 1024), EventLog(), lambda: None)


@pytest.mark.parametrize("shutter_time", [0.0, 0.06])
def test_a_slow_shutter_is_waited_for(shutter_time):
    """50 ms to open: told to wait 60 ms, or seen in spectra that do not agree."""
    with Sts(shutter=0.05) as peer:
        exposer = exposer_on(peer, SpectrometerSettings(read_noise=0.5, shutter_time=shutter_time))
        exposer.set_shutter(True)
        light = exposer.take(0.01).counts
        exposer.set_shutter(False)
        dark = exposer.take(0.01).counts
        assert light[0] == pytest.approx(1700, abs=2)
        assert dark[0] == pytest.approx(1500, abs=2)
        assert peer.refused == []


@pytest.mark.parametrize("left", [{"trigger": 3}, {"averages": 4}, {"boxcar": 5}])
def test_spectrometer_left_in_any_state(left):
    with Sts(**left) as peer:
        exposer = exposer_on(peer)
        exposer.set_shutter(True)
        light = exposer.take(0.01).counts
        assert light[512] == pytest.approx(2100, abs=2), "the line is not smoothed"
        assert light[500] == pytest.approx(1700, abs=2)
        assert (peer.trigger, peer.averages, peer.boxcar) == (0, 1, 0)
        assert peer.refused == []


def test_the_sum_of_scans():
    with Sts() as peer:
        exposer = exposer_on(peer)
        exposer.scans = 40
        exposer.set_shutter(True)
        total = exposer.take(0.01)
        assert total.counts.dtype == np.uint32
        assert total.counts[0] == pytest.approx(40 * 1700, abs=80), "more than 16 bits hold"

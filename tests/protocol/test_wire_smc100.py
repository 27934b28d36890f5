"""SMC100: literal bytes out and in, as in docs/protocols.md."""

import pytest
from wire import IMPATIENT, Dialogue, kinds

from clbrdf.rig.drivers import smc100
from clbrdf.rig.drivers.smc100 import Smc100Line, Smc100Stage
from clbrdf.rig.errors import BadReplyError, InstrumentError, NoReplyError, RefusedError
from clbrdf.rig.roles import Motion


def test_position_is_the_mean_of_two_readings_that_agree():
    """A servo hunts by a count or two around where it stands."""
    with Dialogue((b"1TP\r\n", b"1TP-0.1228\r\n"), (b"1TP\r\n", b"1TP-0.1232\r\n")) as peer:
        line = peer.line()
        assert Smc100Stage(line, 1).get_position(0.002) == pytest.approx(-0.123, abs=1e-12)
        assert kinds(line) == []


def test_positions_that_disagree_are_read_again():
    steps = [(b"2TP\r\n", b"2TP10.5\r\n"), (b"2TP\r\n", b"2TP1.5\r\n"), (b"2TP\r\n", b"2TP10.5\r\n")]
    with Dialogue(*steps, (b"2TP\r\n", b"2TP10.5\r\n")) as peer:
        line = peer.line()
        assert Smc100Stage(line, 2).get_position(0.002) == 10.5
        assert kinds(line) == ["reading disagrees"] * 2


@pytest.mark.parametrize(
    ("word", "motion"),
    [
        ("00000A", Motion.NOT_REFERENCED),
        ("000011", Motion.NOT_REFERENCED),
        ("000014", Motion.CONFIGURATION),
        ("00001E", Motion.HOMING),
        ("00001f", Motion.HOMING),
        ("000028", Motion.MOVING),
        ("000032", Motion.READY),
        ("000033", Motion.READY),
        ("000034", Motion.READY),
        ("000035", Motion.READY),
        ("00003C", Motion.DISABLED),
        ("00003E", Motion.DISABLED),
        ("000046", Motion.MOVING),
    ],
)
def test_states(word, motion):
    with Dialogue((b"3TS\r\n", b"3TS" + word.encode() + b"\r\n")) as peer:
        status = Smc100Stage(peer.line(), 3).get_status()
    assert status.motion is motion
    assert not status.limit
    assert not status.stalled
    assert status.errors == ()


def test_error_bits():
    with Dialogue(
        (b"1TS\r\n", b"1TS000133\r\n"),
        (b"1TS\r\n", b"1TS000233\r\n"),
        (b"1TS\r\n", b"1TS00203D\r\n"),
        (b"1TS\r\n", b"1TS00003D\r\n"),
        (b"1TS\r\n", b"1TS03FF3C\r\n"),
    ) as peer:
        stage = Smc100Stage(peer.line(), 1)
        assert stage.get_status().errors == ("negative end of run",)
        assert stage.get_status().errors == ("positive end of run",)
        status = stage.get_status()
        assert status.stalled
        assert not status.limit
        assert stage.get_status().stalled, "state 3D alone means a stage that was stopped on its way"
        assert len(stage.get_status().errors) == 10


def test_unknown_state_is_refused():
    with Dialogue((b"1TS\r\n", b"1TS0000FF\r\n")) as peer, pytest.raises(RefusedError, match="FF"):
        Smc100Stage(peer.line(), 1).get_status()


def test_move_asks_for_the_command_error():
    with Dialogue((b"1PA10.5\r\n", b""), (b"1TE\r\n", b"1TE@\r\n")) as peer:
        Smc100Stage(peer.line(), 1).start_move(10.5)


def test_damaged_move_is_sent_again():
    with Dialogue(
        (b"1PA-2\r\n", b""), (b"1TE\r\n", b"1TEA\r\n"), (b"1PA-2\r\n", b""), (b"1TE\r\n", b"1TE@\r\n")
    ) as peer:
        Smc100Stage(peer.line(), 1).start_move(-2.0)


def test_move_not_allowed_is_refused_at_once():
    words = "not allowed while not referenced"
    with (
        Dialogue((b"1PA5\r\n", b""), (b"1TE\r\n", b"1TEH\r\n")) as peer,
        pytest.raises(RefusedError, match=words),
    ):
        Smc100Stage(peer.line(), 1).start_move(5.0)


def test_homing_is_sent_once():
    with Dialogue((b"1OR\r\n", b""), (b"1TE\r\n", b"1TEA\r\n")) as peer, pytest.raises(RefusedError):
        Smc100Stage(peer.line(), 1).start_homing()


def test_reset_is_sent_once_and_waited_for():
    """From ready by RS; from configuration by PW0, after which the controller is silent for a while."""
    with Dialogue(
        (b"1TS\r\n", b"1TS000033\r\n"),
        (b"1RS\r\n", b""),
        (b"1TS\r\n", b"1TS000033\r\n"),
        (b"1TS\r\n", b"1TS00000A\r\n"),
        (b"1TS\r\n", b"1TS000014\r\n"),
        (b"1PW0\r\n", b""),
        (b"1TS\r\n", b"1TS00000C\r\n"),
    ) as peer:
        stage = Smc100Stage(peer.line(), 1)
        assert [stage.is_unreferenced() for _ in range(3)] == [False, False, True]
        assert [stage.is_unreferenced() for _ in range(2)] == [False, True]


def test_a_reset_that_was_lost_is_sent_again(monkeypatch):
    """`RS` has no answer: a controller that stays ready has not heard it."""
    monkeypatch.setattr(smc100, "RESET_AGAIN", 0.0)
    with Dialogue(
        (b"1TS\r\n", b"1TS000033\r\n"),
        (b"1RS\r\n", b""),
        (b"1TS\r\n", b"1TS000033\r\n"),
        (b"1RS\r\n", b""),
        (b"1TS\r\n", b"1TS00000A\r\n"),
    ) as peer:
        stage = Smc100Stage(peer.line(), 1)
        assert [stage.is_unreferenced() for _ in range(3)] == [False, False, True]


def test_a_line_of_three():
    steps = [(b"%dTS\r\n" % k, b"%dTS00000A\r\n" % k) for k in (1, 2, 3)]
    steps = [
        step
        for k, status in enumerate(steps, start=1)
        for step in (status, *[(b"%dVE\r\n" % k, b"%dVE SMC_CC_2.0.1\r\n" % k)] * 2)
    ]
    with Dialogue(*steps, (b"ST\r\n", b"")) as peer:
        group = Smc100Line(peer.line(), {"lamp": 1, "turn": 2, "pitch": 3})
        assert group.identify() == "; ".join(["SMC_CC_2.0.1"] * 3)
        group.stop()


def test_a_lost_status_leaves_a_doubt():
    """The controller clears the bits that it reports: a repeated TS may have lost a stall."""
    with Dialogue(
        (b"1TS\r\n", b"1TS0020\r\n"),
        (b"1VE\r\n", b"1VE 1.0\r\n"),
        (b"1TS\r\n", b"1TS000033\r\n"),
        (b"1TS\r\n", b"1TS000033\r\n"),
    ) as peer:
        stage = Smc100Stage(peer.line(), 1)
        assert stage.get_status().doubtful
        assert not stage.get_status().doubtful


def test_an_answer_after_the_deadline_asks_for_a_longer_reply_time():
    """Not the port is wrong: what is needed is time."""
    late = [(b"1TS\r\n", b""), (b"1VE\r\n", b"")] * 3
    words = r"answers later than reply_time allows; set reply_time = "
    with (
        Dialogue(*late, (b"1TS\r\n", b"", 0.6, b"1TS00000A\r\n")) as peer,
        pytest.raises(InstrumentError, match=words),
    ):
        Smc100Stage(peer.line(IMPATIENT), 1).identify()


def test_settings_are_read_back():
    steps = []
    for code, value in ((b"SL", b"-25"), (b"SR", b"25"), (b"VA", b"20"), (b"AC", b"80.5")):
        steps += [
            (b"1" + code + value + b"\r\n", b""),
            (b"1TE\r\n", b"1TE@\r\n"),
            (b"1" + code + b"?\r\n", b"1" + code + value + b"\r\n"),
        ]
    with Dialogue(*steps) as peer:
        Smc100Stage(peer.line(), 1).configure((-25.0, 25.0), 20.0, 80.5)


@pytest.mark.parametrize(
    "bad", [b"\0\x001TP1.5\r\n", b"1TP\xff.5\r\n", b"2TP1.5\r\n", b"1TS1.5\r\n", b"1TP\r\n", b"1TP.5\r\n"]
)
def test_bad_reply_is_repeated_after_resynchronising(bad):
    with Dialogue(
        (b"1TP\r\n", bad),
        (b"1VE\r\n", b"1VE 1.0\r\n"),
        (b"1TP\r\n", b"1TP1.5\r\n"),
        (b"1TP\r\n", b"1TP1.5\r\n"),
    ) as peer:
        line = peer.line()
        assert Smc100Stage(line, 1).get_position(0.002) == 1.5
        assert kinds(line) == ["bad reply"]


def test_late_reply_does_not_shift_the_next_ones():
    with Dialogue(
        (b"1TS\r\n", b""),
        (b"1VE\r\n", b"1TS000028\r\n1VE 1.0\r\n"),
        (b"1TS\r\n", b"1TS000033\r\n"),
    ) as peer:
        line = peer.line(IMPATIENT)
        assert Smc100Stage(line, 1).get_status().motion is Motion.READY
        assert kinds(line) == ["no reply"]


def test_short_replies_end_in_an_error():
    with Dialogue(
        *[step for _ in range(4) for step in ((b"1TP\r\n", b"1TP1"), (b"1VE\r\n", b"1VE 1\r\n"))]
    ) as peer:
        line = peer.line(IMPATIENT)
        with pytest.raises(NoReplyError, match="short reply"):
            Smc100Stage(line, 1).get_position(0.002)
        # The last failure needs no way back into step.
        line.send(b"1VE\r\n")


def test_another_instrument_is_named():
    with (
        Dialogue(
            *[(b"1TS\r\n", b"what?\r\n"), (b"1VE\r\n", b"what?\r\n")] * 3, (b"1TS\r\n", b"?\r\n")
        ) as peer,
        pytest.raises(InstrumentError, match="no SMC100 at address 1 answers"),
    ):
        Smc100Stage(peer.line(IMPATIENT), 1).identify()


def test_positions_that_never_agree():
    steps = [(b"1TP\r\n", b"1TP%d\r\n" % k) for k in range(9)]
    with Dialogue(*steps) as peer, pytest.raises(BadReplyError, match="agree"):
        Smc100Stage(peer.line(), 1).get_position(0.002)

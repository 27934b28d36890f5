"""SMC100: literal bytes out and in, as in knowledge/rig.md."""

import pytest
from wire import IMPATIENT, Dialogue, kinds

from clbrdf.rig.drivers.smc100 import Smc100Stage
from clbrdf.rig.errors import BadReplyError, InstrumentError, NoReplyError, RefusedError
from clbrdf.rig.roles import Motion


def test_position_is_read_twice():
    with Dialogue((b"1TP\r\n", b"1TP-0.123\r\n"), (b"1TP\r\n", b"1TP-0.123\r\n")) as peer:
        assert Smc100Stage(peer.line(), 1).get_position() == -0.123


def test_positions_that_disagree_are_read_again():
    steps = [(b"2TP\r\n", b"2TP10.5\r\n"), (b"2TP\r\n", b"2TP1.5\r\n"), (b"2TP\r\n", b"2TP10.5\r\n")]
    with Dialogue(*steps, (b"2TP\r\n", b"2TP10.5\r\n")) as peer:
        line = peer.line()
        assert Smc100Stage(line, 2).get_position() == 10.5
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


def test_other_commands():
    with Dialogue(
        (b"ST\r\n", b""),
        (b"1RS\r\n", b""),
        (b"1PW0\r\n", b""),
        (b"1MM1\r\n", b""),
        (b"1TE\r\n", b"1TE@\r\n"),
        (b"1PT5\r\n", b"1PT1.25\r\n"),
        (b"1PT5\r\n", b"1PT1.25\r\n"),
        (b"1VE\r\n", b"1VE SMC_CC_2.0.1\r\n"),
    ) as peer:
        stage = Smc100Stage(peer.line(), 1)
        stage.stop()
        stage.reset()
        stage.leave_configuration()
        stage.enable()
        assert stage.get_predicted_time(-5.0) == 1.25
        assert stage._ask("VE", ".+").strip() == "SMC_CC_2.0.1"


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
        assert Smc100Stage(line, 1).get_position() == 1.5
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
            Smc100Stage(line, 1).get_position()
        # The last failure needs no way back into step.
        line.send(b"1VE\r\n")


def test_another_instrument_is_named():
    with (
        Dialogue(
            *[(b"1TS\r\n", b"what?\r\n"), (b"1VE\r\n", b"what?\r\n")] * 3, (b"1TS\r\n", b"?\r\n")
        ) as peer,
        pytest.raises(InstrumentError, match="no SMC100 answers at address 1"),
    ):
        Smc100Stage(peer.line(IMPATIENT), 1).identify()


def test_positions_that_never_agree():
    steps = [(b"1TP\r\n", b"1TP%d\r\n" % k) for k in range(9)]
    with Dialogue(*steps) as peer, pytest.raises(BadReplyError, match="agree"):
        Smc100Stage(peer.line(), 1).get_position()

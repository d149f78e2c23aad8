"""The matching of each ok to the line that it acknowledges."""

import pytest

from machine.firmware.marlin import MARLIN
from machine.link.protocol.answers import ASKED_LIMIT, NOISE_LIMIT, Acknowledgement, Resends
from machine.link.protocol.events import Event, Kind, Temperature
from machine.link.protocol.framing import frame
from machine.link.protocol.window import CLEAN_LINES, Window

OK, WARM = Event(Kind.OK), Event(Kind.OK, temperature=Temperature(20.0, 0.0))


def window(*commands: str) -> Window:
    """Lines in flight, counted from 1."""
    lines = Window()
    for command in commands:
        lines.send(command)
    return lines


@pytest.mark.parametrize(("ok", "numbered", "line"), [
    (OK, False, 1),
    (Event(Kind.OK, line=2), True, 2),
    (OK, True, None),
    (WARM, False, 2),
    (WARM, True, 2),
], ids=["oldest", "named", "not named", "first question", "first question of a printer that names its lines"])  # fmt: skip
def test_an_ok_answers_the_line_it_names_or_the_oldest_one(ok: Event, numbered: bool, line: int | None) -> None:
    assert Acknowledgement().line(ok, window("G1 X1", "M105", "G1 X2"), numbered, 0.0) == line


def test_the_ok_that_belongs_to_a_resend_answers_nothing_once() -> None:
    oks, lines = Acknowledgement(), window("G1 X1")
    oks.expect_resend_ok(until_s=1.0)
    assert [oks.line(OK, lines, False, 0.5) for _ in range(2)] == [None, 1]


def test_the_ok_of_a_resend_is_not_waited_for_long() -> None:
    oks = Acknowledgement()
    oks.expect_resend_ok(until_s=1.0)
    assert oks.line(OK, window("G1 X1"), False, 1.5) == 1


def test_a_plain_ok_is_no_answer_to_a_question_once_one_was_answered_with_a_temperature() -> None:
    oks, lines = Acknowledgement(), window("M105")
    assert oks.line(OK, lines, False, 0.0) == 1
    oks.line(WARM, lines, False, 0.0)
    assert oks.line(OK, lines, False, 0.0) is None


def test_lines_are_repeated_in_order_up_to_the_last_one_sent() -> None:
    resends, window = Resends(), Window()
    for x in range(1, 4):
        window.send(f"G1 X{x}")
    window.clear_flight()
    assert resends.request(2) == ""
    repeated = [resends.repeat(window, 0.0) for _ in range(3)]
    assert repeated == [frame(2, "G1 X2"), frame(3, "G1 X3"), b""]
    assert resends.repeated == 2


def test_resends_of_a_line_are_limited_in_a_row_and_allowed_again_after_an_answer() -> None:
    resends = Resends()
    assert [resends.request(5) for _ in range(ASKED_LIMIT)] == [""] * ASKED_LIMIT
    assert resends.request(5) == "this line 10 times"
    resends.acknowledge(6)
    assert resends.request(5) == ""


def test_too_many_of_the_last_lines_are_too_much_noise() -> None:
    resends = Resends()
    assert [resends.request(5 * k) for k in range(1, NOISE_LIMIT + 1)] == [""] * NOISE_LIMIT
    assert resends.request(5 * (NOISE_LIMIT + 1)) == "20 of the last 200 lines"
    assert resends.request(10_000) == ""


def test_after_a_refused_line_the_next_go_one_by_one_and_after_another_for_longer() -> None:
    lines = Window()

    def take(count: int) -> int:
        for _ in range(count):
            lines.acknowledge(lines.sent if lines.send("G1 X1") else 0)
        return lines.places(MARLIN.line, emergency_parser=True)

    lines.learn(3)
    assert [take(CLEAN_LINES - 1), take(1), take(100)] == [1, 4, 4]
    assert lines.places(MARLIN.line, emergency_parser=False) == 3  # one place is reserved for an M112
    lines.back_off()
    assert [take(0), take(4 * CLEAN_LINES - 1), take(1)] == [1, 1, 4]
    lines.slow_down()
    assert [take(0), take(4 * CLEAN_LINES)] == [1, 4]
    lines.back_off()
    assert [take(16 * CLEAN_LINES - 1), take(1)] == [1, 4]

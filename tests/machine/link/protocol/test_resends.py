"""Lines that are asked for again: one after the other, and not without end."""

from machine.link.protocol.framing import frame
from machine.link.protocol.resends import ASKED_LIMIT, NOISE_LIMIT, Resends
from machine.link.protocol.window import Window


def test_lines_are_repeated_in_order_up_to_the_last_one_sent() -> None:
    resends, window = Resends(), Window()
    for x in range(1, 4):
        window.send(f"G1 X{x}")
    window.clear_flight()
    assert resends.request(2) == ""
    repeated = [resends.repeat(window, 0.0) for _ in range(3)]
    assert repeated == [frame(2, "G1 X2"), frame(3, "G1 X3"), b""]
    assert resends.repeated == 2


def test_a_line_may_be_asked_for_so_often_in_a_row_and_again_after_an_answer() -> None:
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

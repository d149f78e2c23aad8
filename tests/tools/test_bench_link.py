"""What the stream makes of a UART's bandwidth, in virtual time, and that its memory does not grow with the program."""

import tracemalloc
from collections.abc import Iterator

import pytest

from machine.link.medium import Medium
from machine.link.protocol.framing import frame
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from tools.bench_link import LINE_BYTES, Echo, resting, used


@pytest.mark.parametrize(("baud", "rate"), [(115200, 183), (250000, 397)])
def test_a_window_uses_all_that_the_line_carries_and_overfills_nothing(baud: int, rate: int) -> None:
    lines_s, share, repeated, lost = used(resting(600), baud, BuildOptions(rx_ring=128), terminal=False)
    assert lines_s == pytest.approx(rate, rel=0.01)
    assert (share > 0.99, repeated, lost) == (True, 0, 0)


@pytest.mark.parametrize(("baud", "rate"), [(115200, 148), (250000, 275)])
def test_one_line_at_a_time_is_no_slower_than_other_senders(baud: int, rate: int) -> None:
    lines_s, _, repeated, _ = used(resting(600), baud, BuildOptions(advanced_ok=False, rx_ring=128), terminal=False)
    assert lines_s > rate
    assert repeated == 0


def test_the_bench_s_lines_have_the_length_that_it_names() -> None:
    assert {len(frame(number, line)) for number, line in enumerate(resting(3000), 4)} == {LINE_BYTES}


def streamed_bytes(count: int) -> int:
    """Memory, at most, of a print of so many lines that are made while they are sent."""

    def lines() -> Iterator[str]:
        for k in range(count):
            yield f"G1 X{k % 200}.5 Y{k % 100}"

    now = [0.0]

    def clock() -> float:
        now[0] += 1e-4
        return now[0]

    tracemalloc.start()
    outcome = print_lines(lines(), "echo", medium=Medium(lambda name, baud: Echo(), clock, lambda seconds: None))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert outcome.acknowledged == count
    return peak


def test_memory_does_not_grow_with_the_program() -> None:
    assert streamed_bytes(20000) < streamed_bytes(2000) + 20_000

"""The share of a UART's bandwidth that the stream uses, in virtual time, and memory independent of the program's length."""

import tracemalloc
from collections.abc import Iterator

import pytest

from machine.link.medium import Medium
from machine.link.protocol.framing import frame
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from tools.bench.link import LINE_BYTES, resting, used


@pytest.mark.parametrize(("baud", "rate"), [(115200, 183), (250000, 397)])
def test_a_window_uses_all_that_the_line_carries_and_overfills_nothing(baud: int, rate: int) -> None:
    lines_s, share, repeated, lost = used(resting(600), baud, BuildOptions(rx_ring=128))
    assert lines_s == pytest.approx(rate, rel=0.01)
    assert (share > 0.99, repeated, lost) == (True, 0, 0)


@pytest.mark.parametrize(("baud", "rate"), [(115200, 148), (250000, 275)])
def test_one_line_at_a_time_is_no_slower_than_other_senders(baud: int, rate: int) -> None:
    lines_s, _, repeated, _ = used(resting(600), baud, BuildOptions(advanced_ok=False, rx_ring=128))
    assert lines_s > rate
    assert repeated == 0


def test_the_bench_s_lines_have_the_length_that_it_names() -> None:
    assert {len(frame(number, line)) for number, line in enumerate(resting(3000), 4)} == {LINE_BYTES}


class Echo:
    """A line to a peer that acknowledges every command at once and stores nothing."""

    name = "echo"

    def __init__(self) -> None:
        self._said = bytearray()

    def write(self, data: bytes) -> None:
        """Acknowledge every numbered line."""
        for line in data.split(b"\n"):
            number, _, command = line[1:].partition(b" ")
            if command.startswith(b"M105"):
                self._said += b"ok T:20.00 /0.00 B:20.00 /0.00\n"
            elif line[:1] == b"N":
                self._said += b"ok N%s P15 B3\n" % (number if not command.startswith(b"M110") else command[6:].partition(b"*")[0])

    def read(self) -> bytes:
        """All answers so far."""
        said = bytes(self._said)
        self._said.clear()
        return said

    def discard(self) -> None:
        """Nothing to discard."""

    def close(self) -> None:
        """Nothing to close."""


def streamed_bytes(count: int) -> int:
    """Peak memory of a print whose lines are generated while they are sent."""

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

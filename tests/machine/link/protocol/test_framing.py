"""Framing: line numbers, checksums and refused commands."""

from functools import reduce
from operator import xor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.link.protocol.framing import LINE_LIMIT, checksum, command_of, frame
from profiles.errors import LocalProtocolError


@given(st.binary(max_size=128))
def test_the_folded_checksum_is_the_xor_of_all_bytes(body: bytes) -> None:
    assert checksum(body) == reduce(xor, body, 0)


@pytest.mark.parametrize(("number", "command", "line"), [
    (0, "M110 N0", b"N0 M110 N0*125\n"),
    (3, "T0", b"N3 T0*57\n"),
    (4, "G92 E0", b"N4 G92 E0*67\n"),
    (5, "G28", b"N5 G28*22\n"),
    (6, "G1 F1500.0", b"N6 G1 F1500.0*82\n"),
    (7, "G1 X2.0 Y2.0 F3000.0", b"N7 G1 X2.0 Y2.0 F3000.0*85\n"),
])  # fmt: skip
def test_framing_gives_the_lines_of_the_reprap_wiki(number: int, command: str, line: bytes) -> None:
    assert frame(number, command) == line


def test_the_longest_framed_line_is_what_marlin_keeps() -> None:
    assert max(len(frame(1, "M117 " + "x" * n)) - 1 for n in range(80, 84)) <= LINE_LIMIT
    with pytest.raises(LocalProtocolError, match="at most 95"):
        frame(1, "M117 " + "x" * 90)


@pytest.mark.parametrize(("line", "command"), [
    ("G1 X1 ; out\n", "G1 X1"), ("  G28  ", "G28"), (";only", ""), ("\n", ""), ("G1\tX1", "G1 X1"), ("M98 Pö;", None),
    ("M117 ö;", "M117 o"), ("N1 G28", "G28"), ("M 112", None), ("G1 X5 ;PAUSE:x", "G1 X5"), ("M0 ;PAUSE:x", ""),
    ("M82\\", None), ("G1 X5 (Y2)", "G1 X5"),
    ("M98 Pa*b", None), ("M112", None), ("m110 N5", None), ("M1080", "M1080"), ("M117 " + "x" * 90, None),
])  # fmt: skip
def test_a_line_of_a_program_becomes_a_command_or_is_refused(line: str, command: str | None) -> None:
    if command is not None:
        assert command_of(line, 7) == command
        return
    with pytest.raises(LocalProtocolError, match="line 7"):
        command_of(line, 7)

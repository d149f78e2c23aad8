"""The lines of a path, against Python's own way to write numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.path_text import PathWords, as_bytes, path_text

WHOLE = st.integers(-(10**9), 10**9)
POINTS = st.lists(st.tuples(st.sampled_from([0, 5, -1500]), WHOLE, st.sampled_from([200, -7]), WHOLE), min_size=1, max_size=20)


def by_python(points: list[tuple[int, int, int, int]], relative: bool, known: list[int]) -> list[str]:
    lines, ending = [], " F1200"
    for *point, pushed in points:
        changed = [k for k in range(3) if point[k] != known[k]]
        if changed:
            words = "".join(f" {'XYZ'[k]}{point[k] / 1000:.3f}" for k in changed)
            lines.append(f"G1{words} E{(pushed - known[3] if relative else pushed) / 1e5:.5f}{ending}")
            known[:], ending = [*point, pushed], ""
    return lines


@pytest.mark.parametrize("relative", [True, False])
@given(POINTS)
def test_lines_are_those_that_python_writes(relative: bool, points: list[tuple[int, int, int, int]]) -> None:
    table = np.array(points, dtype=np.int64)
    words = PathWords(as_bytes("G1"), ord("E"), relative, as_bytes(" F1200"))
    theirs, ours = [0, 0, 200, 17], np.array([0, 0, 200, 17])
    assert path_text(table[:, :3].copy(), table[:, 3].copy(), words, ours).splitlines() == by_python(points, relative, theirs)
    assert ours.tolist() == theirs


def test_a_point_where_the_tip_is_gives_its_filament_to_the_next_line() -> None:
    words = PathWords(as_bytes("G1"), ord("U"), True, as_bytes(""))
    points = np.array([[1000, 0, 0], [1000, 0, 0], [1000, -5, 0]])
    lines = path_text(points, np.array([100, 300, 700]), words, np.array([0, 0, 0, 0])).splitlines()
    assert lines == ["G1 X1.000 U0.00100", "G1 Y-0.005 U0.00600"]

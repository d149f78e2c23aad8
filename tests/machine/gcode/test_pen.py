"""The text of many moves, compared with Python's own number formatting."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.firmware import dialects
from machine.gcode.lines import Texts
from machine.gcode.pen import PUSHING, STANDING, TRAVELLING, Paths, Pen
from mdp.mesh import Floats
from mdp.pose import level
from profiles.profile import load

Point = tuple[float, float, float, float]  # X Y Z, and the filament of the step to that point
MM = st.integers(-(10**8), 10**8).map(lambda thousandths: thousandths / 1000.0)
ROWS = st.lists(st.tuples(st.sampled_from([0.0, 0.005, -1.5]), MM, st.sampled_from([0.2, -0.007]), MM), min_size=2, max_size=20)
NO_TEXT = ("", "")
MACHINE = load().machine


def pen(letter: str = "E", relative: bool = True, known: tuple[int, ...] = (0, 0, 0, 0, 0)) -> Pen:
    dialect = replace(dialects()["marlin"], travel="G0", filament_relative=relative)
    return Pen(dialect, MACHINE, letter, level(MACHINE), np.array(known))


def texts(*lines: str) -> Texts:
    return Texts.of([line.encode() for line in lines])


def path(rows: list[Point], does: int, speed: float = 20.0, most_mm_s: float = 1e9) -> Paths:
    table = np.array(rows)
    starts, kinds = np.array([0, len(rows)]), np.array([does], np.int8)
    return Paths(table[:, :3].copy(), table[:, 3].copy(), starts, kinds, np.array([speed]), np.array([most_mm_s]))


def by_python(rows: list[Point]) -> list[str]:
    """A travel through points in whole thousandths of a mm."""
    lines, tip, ending = [], (0.0, 0.0, 0.0), " F1200"
    for *point, _ in rows[1:]:
        changed = "".join(f" {'XYZ'[k]}{point[k]:.3f}" for k in range(3) if point[k] != tip[k])
        if changed:
            lines.append(f"G0{changed}{ending}")
            tip, ending = (point[0], point[1], point[2]), ""
    return lines


@given(ROWS)
def test_a_travel_is_written_as_python_writes_it(rows: list[Point]) -> None:
    assert pen().paths(path(rows, TRAVELLING), texts(*NO_TEXT)).splitlines() == by_python(rows)


@pytest.mark.parametrize("relative", [True, False])
@given(st.lists(st.integers(1, 10**6), min_size=1, max_size=20))
def test_the_filament_of_a_stroke_adds_up_to_the_last_digit(relative: bool, pushed: list[int]) -> None:
    rows = [(0.0, 0.0, 0.0, 0.0), *((float(k), 0.0, 0.0, 1e-5 * e) for k, e in enumerate(pushed, 1))]
    lines = pen("U", relative).paths(path(rows, PUSHING), texts(*NO_TEXT)).splitlines()
    written = [line.split(" U")[1].split()[0] for line in lines]
    sums = np.cumsum(pushed)
    assert written == [f"{e / 1e5:.5f}" for e in (pushed if relative else sums.tolist())]


def test_a_point_where_the_tip_is_gives_its_filament_to_the_next_line() -> None:
    rows = [(1.0, 0.0, 0.0, 0.0), (1.0, 0.0004, 0.0, 0.002), (1.0, -0.005, 0.0, 0.004)]
    (line,) = pen("U", known=(1000, 0, 0, 0, 1200)).paths(path(rows, PUSHING), texts(*NO_TEXT)).splitlines()
    assert line.split(" F")[0] == "G1 Y-0.005 U0.00600"


def test_a_retraction_is_a_line_of_filament_alone() -> None:
    line = pen(known=(1000, 0, 0, 0, 1200)).paths(path([(1.0, 0.0, 0.0, -0.8)], STANDING, 35.0), texts(*NO_TEXT))
    assert line == "G1 E-0.80000 F2100\n"


@pytest.mark.parametrize(("most_mm_s", "feed"), [(0.7, 1200), (0.6, 1143)])
def test_a_stroke_that_rounding_shortens_is_slowed_only_where_its_filament_is_too_fast(most_mm_s: float, feed: int) -> None:
    """0.0124 mm with 0.03 mm of filament per mm is written as 0.012 mm: 20 mm/s need 0.62 mm/s of filament, not 0.6."""
    rows = [(0.0, 0.0, 0.0, 0.0), (0.0124, 0.0, 0.0, 0.03 * 0.0124)]
    (line,) = pen().paths(path(rows, PUSHING, 20.0, most_mm_s), texts(*NO_TEXT)).splitlines()
    assert line.split(" F")[1] == str(feed)


def test_texts_precede_their_paths_and_the_last_one_follows_all_paths() -> None:
    points: Floats = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]])
    two = Paths(
        points, np.array([0, 0.5, 0, 0.5]), np.array([0, 2, 4]), np.array([0, 0], np.int8), np.full(2, 20.0), np.full(2, 1e9)
    )
    text = pen().paths(two, texts(";first\n", ";second\n", ";end\n"))
    assert text.splitlines() == [";first", "G1 X1.000 E0.50000 F1200", ";second", "G1 X2.000 E0.50000", ";end"]


def test_a_path_that_writes_no_line_does_not_change_the_current_feed() -> None:
    points: Floats = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]])
    speed = np.array([20.0, 50.0, 20.0])
    three = Paths(points, np.zeros(6), np.array([0, 2, 4, 6]), np.array([1, 1, 1], np.int8), speed, np.full(3, 1e9))
    lines = pen().paths(three, texts("", "", "", "")).splitlines()
    assert lines == ["G0 X1.000 F1200", "G0 X2.000"]


@pytest.mark.parametrize("relative", [True, False])
@given(st.lists(st.floats(-0.4, 0.4), min_size=2, max_size=20))
def test_filament_rounded_in_one_call_is_made_up_for_in_the_next(relative: bool, pushed: list[float]) -> None:
    """The sum of the written amounts equals the sum pushed, to the last digit, however the paths are split over calls."""
    writes, sums = pen("E", relative), 0.0
    for k, e in enumerate(pushed):
        rows = [(float(k), 0.0, 0.0, 0.0), (float(k + 1), 0.0, 0.0, e)]
        (line,) = writes.paths(path(rows, PUSHING), texts(*NO_TEXT)).splitlines()
        written = float(line.split(" E")[1].split()[0])
        sums = sums + written if relative else written
        assert sums == pytest.approx(sum(pushed[: k + 1]), abs=0.6e-5)
    assert writes.known[:3].tolist() == [1000 * len(pushed), 0, 0]
    assert writes.known[3] == round(writes.pushed_mm[0] * 1e5)
    assert writes.known[4] == 1200

"""The time left of a print whose lines are streamed to a printer."""

import pytest

from machine.link.print_state import PrintStatus
from machine.printing.serial_print import time_left_s


def remaining_s(line: int) -> float:
    return 1000.0 - 100.0 * line


def test_the_time_left_is_that_of_the_lines_left_at_the_feed_override() -> None:
    status = PrintStatus(file_line=3, feed_percent=50.0, elapsed_s=1.0)
    assert time_left_s(remaining_s, 1, status, 2.0) == pytest.approx((1000.0 - 300.0) / 2.0 / 0.5)


def test_an_unknown_pace_is_replaced_by_the_pace_so_far() -> None:
    status = PrintStatus(file_line=4, feed_percent=50.0, elapsed_s=10.0)
    assert time_left_s(remaining_s, 3, status, None) == pytest.approx(600.0 * 10.0 / 200.0)
    assert time_left_s(remaining_s, 5, status, None) is None

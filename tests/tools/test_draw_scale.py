"""The picture of how cost grows is drawn from the page's own tables."""

import re

from tools.draw_scale import PAGE, PICTURE, draw, tables

TABLE = "| faces | core s |\n|---|---|\n| 5000 | 2.5 |\n| 80000 | 40 |\n\n| word | text |\n|---|---|\n| a | b |\n"


def test_the_picture_is_that_of_the_page_s_tables() -> None:
    assert PICTURE.read_text(encoding="utf-8") == draw(PAGE.read_text(encoding="utf-8")), (
        "python tools/draw_scale.py draws it anew"
    )


def test_tables_of_numbers_are_read_by_column_and_those_of_words_passed_over() -> None:
    assert tables(TABLE) == {"faces": {"faces": [5000.0, 80000.0], "core s": [2.5, 40.0]}}


def test_all_that_is_drawn_is_inside_the_picture() -> None:
    points = re.findall(r'circle cx="([\d.-]+)" cy="([\d.-]+)"', draw(PAGE.read_text(encoding="utf-8")))
    assert points
    assert all(52 <= float(x) <= 330 and 0 <= float(y) <= 250 for x, y in points)

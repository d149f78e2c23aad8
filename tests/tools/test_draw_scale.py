"""The picture of how cost grows is drawn from the page's own tables."""

from html import unescape

from tools.docs.draw_scale import PAGE, PICTURE, described, tables

TABLE = "| faces | core s |\n|---|---|\n| 5000 | 2.5 |\n| 80000 | 40 |\n\n| word | text |\n|---|---|\n| a | b |\n"


def test_the_picture_is_that_of_the_page_s_tables() -> None:
    shown = unescape(PICTURE.read_text(encoding="utf-8"))
    assert described(PAGE.read_text(encoding="utf-8")) in shown, "python tools/docs/draw_scale.py draws it anew"


def test_tables_of_numbers_are_read_by_column_and_those_of_words_passed_over() -> None:
    assert tables(TABLE) == {"faces": {"faces": [5000.0, 80000.0], "core s": [2.5, 40.0]}}

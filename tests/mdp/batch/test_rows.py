"""Rows: a table reads back as it was written, wherever its writing stopped."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from mdp.batch.rows import append_row, read_rows, write_rows, writing_alone
from profiles.errors import UserError


@dataclass(frozen=True)
class Row:
    name: str
    count: int = 0
    mm: float = 0.0


def test_rows_come_back_as_they_were_with_any_name_that_a_file_can_have(tmp_path: Path) -> None:
    rows = [Row('a, "b"', 3, 0.25), Row("two\nlines"), Row("no text \udcff")]
    write_rows(tmp_path / "t.csv", Row, rows[:1])
    for row in rows[1:]:
        append_row(tmp_path / "t.csv", row)
    assert read_rows(tmp_path / "t.csv", Row) == rows


def test_a_table_is_plain_csv(tmp_path: Path) -> None:
    write_rows(tmp_path / "t.csv", Row, [Row("a", 1, 0.5)])
    assert (tmp_path / "t.csv").read_text() == "name,count,mm\na,1,0.5\n"
    assert [file.name for file in tmp_path.iterdir()] == ["t.csv"]


def test_a_last_line_that_was_cut_off_counts_for_nothing(tmp_path: Path) -> None:
    write_rows(tmp_path / "t.csv", Row, [Row("a")])
    with (tmp_path / "t.csv").open("a") as file:
        file.write("b,1")
    assert read_rows(tmp_path / "t.csv", Row) == [Row("a")]


def test_a_missing_table_has_no_rows(tmp_path: Path) -> None:
    assert read_rows(tmp_path / "t.csv", Row) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,size\na,1\n", "its columns are not name, count, mm"),
        ("name,count,mm\na,many,1.0\nb,1,1.0\n", "line 2 does not fit the columns of this table"),
    ],
)
def test_a_damaged_table_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(UserError, match=message):
        read_rows(tmp_path / "t.csv", Row)


def test_two_runs_do_not_write_into_one_folder(tmp_path: Path) -> None:
    message = "another run writes into it; wait for it or take another"
    with writing_alone(tmp_path, "lock"), pytest.raises(UserError, match=message), writing_alone(tmp_path, "lock"):
        pass
    with writing_alone(tmp_path, "lock"):
        pass

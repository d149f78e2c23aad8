"""Names and file contents send no control sequences to the terminal, and no message is endless."""

import os
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.notices import marked_line, plain_line, plain_lines
from profiles.messages import key_name, option, terminal_words


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("red \x1b[31m, bell \x07, back \x08", r"red \x1b[31m, bell \x07, back \x08"),
        ("C1 \x9b31m and DEL \x7f", r"C1 \x9b31m and DEL \x7f"),
        ("a\nb\tc\r", r"a\nb\tc\r"),
        ("evil \u202egnp.exe\u2066", r"evil \u202egnp.exe\u2066"),
        ("a byte that is no UTF-8: \udcff", r"a byte that is no UTF-8: \udcff"),
        ("Grüße, 20 °C, 模型, a\u00a0b", "Grüße, 20 °C, 模型, a\u00a0b"),
    ],
)
def test_controls_are_escaped_and_letters_of_all_kinds_stay(text: str, shown: str) -> None:
    assert plain_line(text) == shown


def test_a_text_of_several_lines_keeps_its_newlines_only() -> None:
    assert plain_lines("a\x1b\nb\n") == "a\\x1b\nb\n"


def test_the_middle_of_a_long_word_or_message_is_replaced_by_its_length() -> None:
    assert plain_line(f"a {'x' * 3_000_000}y z") == f"a {'x' * 120} [2999821 characters left out] {'x' * 59}y z"
    assert len(plain_line("word " * 100_000)) < 1600
    assert plain_line(f"there is no file {'d/' * 100}a.stl") == f"there is no file {'d/' * 100}a.stl"


def test_a_line_with_marks_is_as_long_as_a_terminal_shows_it_and_no_mark_is_cut_through() -> None:
    many = "; ".join(f"{key_name('process.layer_height_mm')} is {k}" for k in range(40))
    assert terminal_words(marked_line(many)) == plain_line(many)
    assert "left out" not in plain_line("; ".join([key_name("process.layer_height_mm")] * 40))
    long = f"{option('plan', 'x' * 400)} is no plan"
    assert terminal_words(marked_line(long)) == plain_line(long)


def test_a_value_that_holds_a_delimiter_of_marks_is_shown_once_with_it_escaped() -> None:
    assert terminal_words(option("plan", "a\ufdd1b")) == r"--plan a\ufdd1b"


def test_a_name_with_an_escape_code_and_a_newline_is_one_plain_line_of_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("\x1b[2J\n.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \x1b[31m{'x' * 5000}\n")
    assert main(["decompose", "\x1b[2J\n.obj"]) == 1
    error = capsys.readouterr().err
    assert error.startswith(r"tiltprint: \x1b[2J\n.obj: the face in line 4 is malformed: `1 2 \x1b[31mxxx")
    assert (error.count("\n"), len(error) < 400) == (1, True)


def test_no_message_is_lost_for_a_name_that_is_no_text(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", os.fsdecode(b"\xff\x1b.gcode")]) == 1
    assert r"G-code file \udcff\x1b.gcode cannot be read" in capfd.readouterr().err

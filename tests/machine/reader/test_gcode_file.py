"""A G-code file, line by line or as its lines."""

from pathlib import Path

import pytest

from machine.reader.gcode_file import GcodeFile
from profiles.errors import GcodeError


def test_a_gcode_file_is_read_line_by_line_as_often_as_wanted(tmp_path: Path) -> None:
    (tmp_path / "p").write_bytes("\ufeffG28\r\nG1 X5 ; ü\n\nM84".encode())
    file = GcodeFile(tmp_path / "p")
    assert list(file) == list(file) == file.lines() == ["G28", "G1 X5 ; ü", "", "M84"]


@pytest.mark.parametrize(("content", "words"), [(None, "cannot be read: no such file"), (b"G1 X\0\n", "is not text")])
def test_a_gcode_file_that_cannot_be_read_is_one_sentence(tmp_path: Path, content: bytes | None, words: str) -> None:
    if content is not None:
        (tmp_path / "p").write_bytes(content)
    with pytest.raises(GcodeError, match=words):
        list(GcodeFile(tmp_path / "p"))
    with pytest.raises(GcodeError, match=words):
        GcodeFile(tmp_path / "p").lines()

"""A G-code file, read line by line or as a list of lines."""

from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.gcode.lines import GcodeFile
from machine.link.protocol.framing import command_of
from machine.printing.servers.server import GcodeUpload
from profiles.errors import GcodeError
from profiles.profile import load


def test_a_gcode_file_is_read_line_by_line_as_often_as_wanted(tmp_path: Path) -> None:
    (tmp_path / "p").write_bytes("\ufeffG28\r\nG1 X5 ; ü\n\nM84".encode())
    file = GcodeFile(tmp_path / "p")
    assert list(file) == list(file) == file.lines() == ["G28", "G1 X5 ; ü", "", "M84"]


@pytest.mark.parametrize("content", [b"G28\n\nG1 X5", b"G28\n\nG1 X5\n", b"G28\r\rG1 X5\r"])
def test_a_file_has_the_same_lines_however_they_end(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "p").write_bytes(content)
    assert GcodeFile(tmp_path / "p").lines() == list(GcodeFile(tmp_path / "p")) == ["G28", "", "G1 X5"]


@pytest.mark.parametrize(("content", "words"), [(None, "cannot be read: no such file"), (b"G1 X\0\n", "is not text")])
def test_a_gcode_file_that_cannot_be_read_is_one_sentence(tmp_path: Path, content: bytes | None, words: str) -> None:
    if content is not None:
        (tmp_path / "p").write_bytes(content)
    with pytest.raises(GcodeError, match=words):
        list(GcodeFile(tmp_path / "p"))
    with pytest.raises(GcodeError, match=words):
        GcodeFile(tmp_path / "p").lines()


def test_cp1252_letters_in_comments_and_messages_are_sent_as_ascii_and_reported_once(tmp_path: Path) -> None:
    wanted = ["G28 ; Größe", "M117 Düse heiß", "M117 Düse kühl", "G1 X5 F60"]
    (tmp_path / "p").write_bytes("\n".join(wanted).encode("cp1252"))
    lines = GcodeFile(tmp_path / "p").lines()
    assert list(lines) == wanted
    assert [command_of(line, 1) for line in lines] == ["G28", "M117 Duse heiss", "M117 Duse kuhl", "G1 X5 F60"]
    assert GcodeUpload("p.gcode", lines).content.decode("utf-8").splitlines() == wanted
    told = [(finding.line, finding.message) for finding in dry_run(lines, load()).findings if finding.code == "text"]
    assert told == [(2, "'M117 Düse heiß' is sent as 'M117 Duse heiss': a serial line carries ASCII only, 2 times")]


def test_an_old_letter_in_a_move_is_refused_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "p").write_bytes(b"G28\nG1 X\xff\n")
    with pytest.raises(GcodeError, match="line 2: 'G1 Xÿ' cannot be read as G-code"):
        dry_run(GcodeFile(tmp_path / "p").lines(), load())

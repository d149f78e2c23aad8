import os
import threading
from pathlib import Path

import pytest

from machine.pipeline.output import check_writable, write_bytes, write_json, write_lines
from profiles.errors import OutputError


def test_a_file_is_written_completely_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    write_lines(tmp_path / "a.gcode", ["G28", "M84"])
    assert [file.name for file in tmp_path.iterdir()] == ["a.gcode"]
    assert (tmp_path / "a.gcode").read_text() == "G28\nM84\n"


def test_a_link_keeps_pointing_to_the_file_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write_bytes(tmp_path / "link", b"new")
    assert ((tmp_path / "link").is_symlink(), (tmp_path / "file").read_bytes()) == (True, b"new")


def test_a_pipe_is_written_into_and_not_replaced(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_bytes(pipe, b"through")
    reader.join()
    assert (read, pipe.is_fifo()) == ([b"through"], True)


def test_a_name_as_long_as_names_may_be_is_written(tmp_path: Path) -> None:
    write_bytes(tmp_path / ("é" * 125), b"")
    with pytest.raises(OutputError, match="file name too long"):
        write_bytes(tmp_path / ("é" * 150), b"")
    assert len(list(tmp_path.iterdir())) == 1


def test_a_full_disk_is_one_sentence_and_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "old.json").write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "chmod", full)
    with pytest.raises(OutputError, match=r"old.json cannot be written: no space left on device"):
        write_json(tmp_path / "old.json", {"new": 1})
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


def test_a_read_only_file_is_refused_before_any_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kept").touch(0o400)
    monkeypatch.setattr(os, "access", lambda path, _mode: bool(os.stat(path).st_mode & 0o200))  # root may write everywhere
    with pytest.raises(OutputError, match="exists and is not writable"):
        check_writable(tmp_path / "kept")

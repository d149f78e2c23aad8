"""The printer of last time: kept for the next start, forgotten where nothing sound is kept."""

from pathlib import Path

import pytest

from machine.pipeline.requests import PrintRequest
from machine.workbench.printing.last_printer import FILE, keep_printer, last_printer
from profiles.folders import state_folder


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def test_the_printer_of_last_time_is_known_at_the_next_start() -> None:
    assert last_printer() is None
    keep_printer(PrintRequest("/dev/ttyACM0", 250000, 1.0))
    assert last_printer() == PrintRequest("/dev/ttyACM0", 250000, 1.0)


@pytest.mark.parametrize("content", ["", "{", "[]", '{"port": "sim"}', '{"port": "sim", "baud": "fast", "sim_speed": 1}'])
def test_what_is_damaged_says_nothing(content: str) -> None:
    (state_folder() / FILE).write_text(content)
    assert last_printer() is None

"""The printer of last time: kept for the next start, forgotten where nothing sound is kept."""

from pathlib import Path

import pytest

from machine.printing.destination import Destination, SerialPort, Simulated, parse_server_address
from machine.workbench.printing.prints import FILE, Prints, keep_printer, last_printer
from profiles.folders import state_folder


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@pytest.mark.parametrize("at", [SerialPort("/dev/ttyACM0", 250000), Simulated(2.0), parse_server_address("duet:printer")])
def test_the_printer_of_last_time_is_known_at_the_next_start(at: Destination) -> None:
    assert last_printer() is None
    assert Prints().snapshot()["last_printer"] is None
    keep_printer(at)
    assert last_printer() == at
    assert Prints().snapshot()["last_printer"]["port"] == at.name
    assert Prints().ports_known == {at.name}


@pytest.mark.parametrize("text", [
    "", "{", "[]", "{}", "null", '{"port": "sim"}', '{"port": "sim", "baud": "fast", "sim_speed": 1}',
    '{"port": 1, "baud": "x", "sim_speed": 0}', '{"port": "/dev/ttyS0", "baud": 7, "sim_speed": 0}',
])  # fmt: skip
def test_a_file_that_names_no_printer_is_as_none(text: str) -> None:
    (state_folder() / FILE).write_text(text)
    assert last_printer() is None

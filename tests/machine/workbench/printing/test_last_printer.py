"""The printer that was printed at last, kept for the next start."""

import pytest

from machine.pipeline.requests import PrintRequest
from machine.workbench.printing.last_printer import FILE, keep_printer, last_printer
from machine.workbench.printing.prints import Prints
from profiles.folders import state_folder


def test_the_printer_of_last_time_is_known_at_the_next_start() -> None:
    assert Prints().snapshot()["last_printer"] is None
    keep_printer(PrintRequest("/dev/ttyACM0", 250000))
    assert last_printer() == PrintRequest("/dev/ttyACM0", 250000)
    assert Prints().snapshot()["last_printer"]["port"] == "/dev/ttyACM0"
    assert Prints().ports_known == {"/dev/ttyACM0"}


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"port": 1, "baud": "x", "sim_speed": 0}', "null"])
def test_a_file_that_names_no_printer_is_as_none(text: str) -> None:
    (state_folder() / FILE).write_text(text)
    assert last_printer() is None

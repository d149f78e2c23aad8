"""What a print server tells, as the progress of a print."""

import pytest

from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.events import Temperature
from machine.printing import server_print
from machine.printing.server_print import ReportedProgress


def test_the_temperatures_of_a_server_that_does_not_answer_grow_old(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr(server_print, "monotonic", lambda: now_s)
    progress = ReportedProgress()
    first, second = (PrintStatus(PrintState.PRINTING, temperature=Temperature(209.6, 210.0, 60.0, 60.0)) for _ in range(2))
    assert progress.at(first, "").heat_age_s == 0.0
    now_s += 20.0
    assert (progress.at(first, "no answer").heat_age_s, progress.at(first, "no answer").heat_is_old) == (20.0, True)
    assert progress.last_known == "; nozzle 210 deg C, bed 60 deg C as last known, 20 s before"
    assert (progress.at(second, "").heat_age_s, progress.at(second, "").heat_is_old) == (0.0, False)

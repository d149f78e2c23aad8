"""Manual control of a printer: safe heating, homing and moves only, and heaters off at the end."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any

import pytest

from machine.firmware import dialect_of
from machine.gcode.blocks import filled_start
from machine.link.pending_commands import Command
from machine.link.print_state import PrintState
from machine.printing.destination import Simulated
from machine.printing.job import Does, End, PrintJob
from machine.workbench.printing.at_hand import by_hand, check_level, homing_lines, jog_target_mm
from machine.workbench.printing.at_page import AtPage, HandCommand, HandDoes
from profiles.errors import MoveError
from profiles.profile import load

PROFILE = load()
MACHINE, FRACTAL = PROFILE.machine, load(machine="fractal5pro")


def wait_until(condition: Callable[[], object]) -> None:
    end_s = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.01)


class Reporter:
    """A reporter that only records."""

    def __init__(self) -> None:
        self.state: dict[str, Any] = {}

    def tell(self, **values: Any) -> None:
        self.state |= values


@contextmanager
def in_hand() -> Iterator[tuple[AtPage, Reporter]]:
    told = Reporter()
    person = AtPage(told)  # type: ignore[arg-type]

    def serve() -> None:
        try:
            told.tell(end=by_hand(PrintJob(Simulated(), Does.HAND, profile=PROFILE), person))
        except Exception as error:  # noqa: BLE001 - reported as the process does
            told.tell(end=End(PrintState.FAILED, str(error)))

    thread = Thread(target=serve, daemon=True)
    thread.start()
    wait_until(lambda: "status" in told.state)
    try:
        yield person, told
    finally:
        person.leave()
        thread.join(30.0)


def test_a_printer_is_heated_homed_and_moved_and_its_heaters_go_off_when_it_is_let_go_of() -> None:
    with in_hand() as (person, told):
        person.hear(HandCommand(HandDoes.JOG, "X", 1.0))
        wait_until(lambda: "only after homing here" in told.state["status"].message)
        person.hear(HandCommand(HandDoes.HEAT))
        wait_until(lambda: told.state["status"].temperature.nozzle_target_c == PROFILE.material.first_layer_nozzle_c)
        assert told.state["status"].temperature.bed_target_c == PROFILE.material.bed_c
        person.hear(HandCommand(HandDoes.HOME))
        wait_until(lambda: told.state["status"].homed)
        before = told.state["status"].at
        person.hear(HandCommand(HandDoes.JOG, "X", 5.0))
        wait_until(lambda: told.state["status"].at["X"] == pytest.approx(before["X"] + 5.0, abs=0.01))
        for _ in range(4):  # farther than the axis reaches
            person.hear(HandCommand(HandDoes.JOG, "X", 99.0))
        wait_until(lambda: "are allowed" in told.state["status"].message)
    assert told.state["end"] == End(PrintState.DONE, "disconnected; the heaters are off")


def test_the_emergency_stop_halts_a_printer_under_manual_control() -> None:
    with in_hand() as (person, told):
        person.hear(Command.EMERGENCY_STOP)
        wait_until(lambda: "end" in told.state)
    assert told.state["end"].sentence.startswith("emergency stop: the printer has halted")


def test_nothing_is_homed_or_moved_over_a_tilted_or_unknown_table() -> None:
    check_level(MACHINE, {"A": 0.0, "C": 90.0}, homing=False)
    with pytest.raises(MoveError, match=r"the table is tilted, at A30.00: nothing is homed or moved before it is level"):
        check_level(MACHINE, {"A": 30.0, "C": 0.0}, homing=True)
    with pytest.raises(MoveError, match="does not report the table's position"):
        check_level(MACHINE, {"X": 0.0}, homing=True)
    check_level(load(machine="three_axis").machine, {"X": 0.0}, homing=False)
    switched_on = dict(zip("XYZAC", MACHINE.home, strict=True))
    check_level(MACHINE, switched_on, homing=True)  # the user is asked
    with pytest.raises(MoveError, match="the table is tilted"):
        check_level(MACHINE, switched_on, homing=False)


def test_homing_is_what_the_start_block_does_without_its_heat() -> None:
    assert homing_lines(filled_start(PROFILE), dialect_of(MACHINE)) == ["G21", "G90", "M83", "M17", "G28 X Y Z", "G92 A0 C0"]
    assert homing_lines(filled_start(FRACTAL), dialect_of(FRACTAL.machine))[-2:] == ["home_ab", "G28"]
    with pytest.raises(MoveError, match="homes nothing"):
        homing_lines(["M104 S200"], dialect_of(MACHINE))


@pytest.mark.parametrize(("axis", "by_mm"), [("Z", -100.0), ("A", 1.0), ("X", 1000.0), ("X", float("nan"))])
def test_a_jog_stays_within_the_limits_and_above_the_table(axis: str, by_mm: float) -> None:
    with pytest.raises(MoveError):
        jog_target_mm(MACHINE, {"X": 0.0, "Y": 0.0, "Z": 10.0}, axis, by_mm)

"""Babystepping: Z is shifted during a print, along the tool in every pose of the table, and restored at the end."""

import re

import numpy as np
import pytest

from machine.firmware import dialect_of
from machine.gcode.modes import axes_of
from machine.link.pending_commands import Command, PendingCommand, PendingCommands
from machine.link.print_state import PrintState
from machine.simulator.faults import Fault
from profiles.errors import PrinterError
from profiles.profile import Profile, load
from tests.machine.link.test_pause import PROGRAM, Watcher, strokes, watched

STROKES = ["G28", "G92 A0 C0", "G21", "G90", "M83", "M104 S200", "M109 S200", "G1 A30 C90 F3000", "G1 X60 Y60 Z40 F6000"]
STROKES += [f"G1 X{60 + k % 20} Y{60 + k // 20} E0.05 F1500" for k in range(300)]
FIRMWARES = [
    ("generic_ac", "M290 Z-0.050", "M290 Z0.050"),
    ("gen5x", "M290 R1 Z-0.050", "M290 R1 Z0.050"),
    ("fractal5pro", "SET_GCODE_OFFSET Z_ADJUST=-0.050 MOVE=1", "SET_GCODE_OFFSET Z_ADJUST=0.050"),
]


def heights(watcher: Watcher) -> set[float]:
    """The real position of the Z axis in strokes."""
    record = watcher.printer.record
    pushed = record.end[:, 5] - record.start[:, 5] > 1e-9
    return set(np.round(record.end[pushed, 2], 6).tolist())


def letters(profile: Profile) -> list[str]:
    """The strokes with the machine's own letters for its table."""
    tilt, turn = profile.machine.tilt.letter, profile.machine.turn.letter
    return [line.replace(" A", f" {tilt}").replace(" C", f" {turn}") for line in STROKES]


@pytest.mark.parametrize(("machine", "sent", "undone"), FIRMWARES)
def test_a_z_offset_shifts_machine_z_with_the_table_turned_and_is_taken_back(machine: str, sent: str, undone: str) -> None:
    profile = load(machine=machine)
    watcher = watched({100: (Command.BABYSTEP, -0.05)}, profile=profile)
    assert not watcher.run(letters(profile)).cancelled
    lines = watcher.lines()
    assert lines.index(sent) < lines.index(undone)
    assert heights(watcher) == {40.0, 39.95}
    assert watcher.shown[-1].z_offset_mm == -0.05


def test_a_pause_after_a_z_offset_finds_its_place_again() -> None:
    watcher = watched({60: (Command.BABYSTEP, 0.05), 150: Command.PAUSE, "paused": Command.RESUME})
    assert not watcher.run(PROGRAM).cancelled
    assert len(strokes(watcher.printer)) > 0


def test_a_z_offset_beyond_2_mm_in_all_is_refused() -> None:
    watcher = watched({60: (Command.BABYSTEP, 1.99), 80: (Command.BABYSTEP, 0.02)})
    watcher.run(PROGRAM)
    assert "a Z offset of 2.01 mm is not possible: -2 to 2 mm are allowed" in {status.message for status in watcher.shown}
    assert watcher.shown[-1].z_offset_mm == 1.99


@pytest.mark.parametrize("machine", ["linuxcnc_xyzac"])
def test_a_firmware_without_babystepping_refuses_it(machine: str) -> None:
    profile = load(machine=machine)
    assert dialect_of(profile.machine).babystep == ""
    watcher = watched({100: (Command.BABYSTEP, 0.05)}, profile=profile)
    watcher.run(PROGRAM)
    assert any(status.message.startswith("no Z offset: this firmware cannot") for status in watcher.shown)


def test_steps_below_a_micrometre_do_not_pass_the_limit_unseen() -> None:
    pending = PendingCommands(axes_of(None), babystep="M290 Z{}")
    for _ in range(5000):
        pending.accept(PendingCommand(Command.BABYSTEP, 0.0005), PrintState.PRINTING, 0.0)
    sent_mm = sum(float(line.removeprefix("M290 Z")) for line in pending.lines)
    assert round(sent_mm, 3) == pending.z_offset_mm <= 2.0


@pytest.mark.parametrize(
    ("known", "resumed_mm", "asked_mm", "offset_mm", "lines"),
    [
        ("M290 Z{}", 0.1, 0.05, 0.15, ["M220 S90", "M290 Z0.050"]),
        ("M290 Z{}", 1.5, 1.0, 1.5, ["M220 S90"]),  # more than 2 mm in all
        ("", 0.0, 0.05, 0.0, ["M220 S90"]),  # the firmware turns out to have no babystepping
    ],
)
def test_a_z_offset_requested_before_the_print_begins_is_added_or_dropped_with_a_message(
    known: str, resumed_mm: float, asked_mm: float, offset_mm: float, lines: list[str]
) -> None:
    pending = PendingCommands(axes_of(None), babystep="M290 Z{}")
    for command, value in ((Command.FEED, 90.0), (Command.BABYSTEP, asked_mm)):
        pending.accept(PendingCommand(command, value), PrintState.PRINTING, 0.0)
    pending.begin_offset(known, resumed_mm)
    assert (pending.z_offset_mm, pending.sent_offset_mm, list(pending.lines)) == (offset_mm, resumed_mm, lines)
    assert (pending.message != "") == (len(lines) == 1)


def test_a_z_offset_requested_while_a_print_finishes_is_neither_sent_nor_taken_back() -> None:
    watcher = watched({len(PROGRAM) - 4: (Command.BABYSTEP, -0.05)})  # as the last commands fill the window
    watcher.run(PROGRAM)
    assert [line for line in watcher.lines() if line.startswith("M290")] == []


def test_a_z_offset_undone_or_never_sent_is_not_reported_as_kept() -> None:
    pending = PendingCommands(axes_of(load(machine="fractal5pro").machine), babystep="SET_GCODE_OFFSET Z_ADJUST={} MOVE=1")
    pending.accept(PendingCommand(Command.BABYSTEP, -0.05), PrintState.PRINTING, 0.0)
    assert pending.kept == ""
    assert pending.undo_overrides() == []


@pytest.mark.parametrize(("machine", "sentence"), [
    ("generic_ac", ""),  # homing resets the offset
    ("fractal5pro", "the printer keeps the Z offset of -0.05 mm: before another print send it SET_GCODE_OFFSET Z_ADJUST=0.050"),
])  # fmt: skip
def test_a_cancelled_print_reports_a_z_offset_kept_by_the_printer(machine: str, sentence: str) -> None:
    profile = load(machine=machine)
    watcher = watched({100: (Command.BABYSTEP, -0.05), 200: Command.CANCEL}, profile=profile)
    outcome = watcher.run(letters(profile))
    assert (outcome.cancelled, outcome.kept) == (True, sentence)


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
def test_a_cancelled_print_sets_feed_and_flow_back(machine: str) -> None:
    profile = load(machine=machine)
    watcher = watched({100: (Command.FEED, 150.0), 110: (Command.FLOW, 90.0), 200: Command.CANCEL}, profile=profile)
    outcome = watcher.run(letters(profile))
    assert (outcome.cancelled, outcome.kept) == (True, "")
    assert {"M220 S150", "M221 S90"} <= set(watcher.lines())
    assert watcher.lines()[-3:] == ["M220 S100", "M221 S100", "M105"]


def test_a_failed_print_reports_the_values_kept_by_the_printer() -> None:
    profile = load(machine="fractal5pro")
    cut = Fault("disconnect", at=250, unit="line")
    watcher = watched({50: (Command.BABYSTEP, -0.05), 60: (Command.FEED, 150.0)}, cut, profile=profile)
    kept = "the printer keeps the feed of 150 % and the Z offset of -0.05 mm: before another print send it M220 S100 and "
    with pytest.raises(PrinterError, match=re.escape(f"{kept}SET_GCODE_OFFSET Z_ADJUST=0.050")):
        watcher.run(letters(profile))


def test_a_print_ended_by_an_error_of_the_caller_reports_the_values_kept_by_the_printer() -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    profile = load(machine="fractal5pro")
    watcher = watched({100: (Command.BABYSTEP, -0.05), 200: interrupt}, profile=profile)
    with pytest.raises(KeyboardInterrupt, match=r"the printer keeps the Z offset of -0\.05 mm"):
        watcher.run(letters(profile))


def test_an_override_that_the_user_types_as_a_line_is_set_back() -> None:
    watcher = watched({100: (Command.LINE, 100.0, "M220 S150"), 200: Command.CANCEL})
    assert watcher.run(PROGRAM).cancelled
    assert watcher.lines()[-2:] == ["M220 S100", "M105"]

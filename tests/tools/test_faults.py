"""A short run of the fault campaign, and tests that its judge detects faults."""

from math import inf

import numpy as np
import pytest

from machine.link.protocol.framing import frame
from machine.link.protocol.window import Window
from machine.link.shutdown import Heaters
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from profiles.errors import PortError
from profiles.profile import load
from tests.machine.virtual_printer import PATH, EndlessError, VirtualPrinter
from tools.campaigns import faults
from tools.campaigns.faults import PROFILE, judged, order, program, reasons, table, trial, wanted

SHORT = 400


@pytest.mark.parametrize("seed", range(60))
def test_a_print_with_random_faults_is_exact_or_stopped_rightly_and_safely(seed: int) -> None:
    assert trial(seed, SHORT).wrong == ()


def test_a_trial_is_the_same_at_every_run() -> None:
    first, second = trial(2, SHORT), trial(2, SHORT)
    assert (first.error, first.virtual_s, first.repeated) == (second.error, second.virtual_s, second.repeated)


def printed(lines: list[str]) -> VirtualPrinter:
    printer = VirtualPrinter(PROFILE.machine)
    print_lines(lines, PATH, medium=printer.medium, profile=PROFILE)
    return printer


@pytest.mark.parametrize(("executed", "words"), [
    (lambda text: [*text[:20], text[19], *text[20:]], "stroke 17 is not the program's"),
    (lambda text: [*text[:20], *text[21:]], "strokes without an error"),
    (lambda text: [*text[:20], text[21], text[20], *text[22:]], "stroke 17 is not the program's"),
    (lambda text: [*text[:-3], text[-4], *text[-3:]], "stroke 33 is not the program's"),
])  # fmt: skip
def test_a_doubled_a_lost_and_an_exchanged_line_are_seen(executed, words: str) -> None:  # type: ignore[no-untyped-def]
    text = program(40)
    problems = order(printed(executed(text)).record, wanted(text), whole=True)
    assert problems
    assert words in problems[0] or "strokes" in problems[0]


def test_heaters_left_on_and_an_error_of_another_kind_are_seen() -> None:
    text = program(40)
    printer = printed(text[:20])
    problems = judged(text, FaultScript((Fault("drop", 5),)), printer, "no such error; the printer reports its heaters off")
    assert problems == ["not the right error: no such error; the printer reports its heaters off", "a heater is on"]


@pytest.mark.parametrize(("instead", "words"), [
    ("M105", "72 of 73 strokes without an error"), ("G1 X1 Y1 E0.5", "stroke 47 is not the program's")])  # fmt: skip
def test_a_sender_that_repeats_something_else_is_caught(monkeypatch: pytest.MonkeyPatch, instead: str, words: str) -> None:
    repeat = Window.repeat
    monkeypatch.setattr(Window, "repeat", lambda window, number, now_s: repeat(window, number, now_s) and frame(number, instead))
    monkeypatch.setattr(faults, "script", lambda seed, lines: FaultScript((Fault("drop", 1900),)))
    assert trial(4, 80).wrong == (words,)


def test_a_host_that_only_says_that_it_switched_the_heaters_off_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.link.shutdown.heaters_off", lambda *given, **named: Heaters.OFF)
    monkeypatch.setattr(faults, "script", lambda seed, lines: FaultScript((Fault("error", 40),)))
    assert trial(4, 80).wrong == ("a heater is on",)


def test_a_host_that_waits_for_ever_is_stopped() -> None:
    printer = VirtualPrinter(PROFILE.machine, most_s=30.0)
    with pytest.raises(EndlessError):
        print_lines(["M109 S200"], PATH, medium=printer.medium)


@pytest.mark.parametrize("dialect", ["marlin", "klipper", "reprapfirmware"])
def test_a_printer_that_never_reads_again_ends_the_print_over_a_new_wire_too(dialect: str) -> None:
    profile, blocked = load(settings=[f"machine.dialect={dialect}"]), FaultScript((Fault("block", 60, seconds=inf),))
    printer = VirtualPrinter(profile.machine, BuildOptions(rx_ring=None), blocked, most_s=900.0)
    with pytest.raises(PortError, match=r"has stopped reading: it took no bytes for 10 s.*heaters may still be on"):
        print_lines(program(2000), PATH, medium=printer.medium, profile=profile)


def test_the_table_counts_every_script_once() -> None:
    trials = [trial(seed, 60) for seed in range(4)]
    counts = np.array([[int(cell) for cell in row.split("|")[2:6]] for row in table(trials).splitlines()[2:]])
    assert counts[:, 0].sum() == 4
    assert (counts[:, 0] == counts[:, 1:].sum(axis=1)).all()
    assert len(reasons(trials).splitlines()) <= 4

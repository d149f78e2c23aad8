"""`tiltprint console` through a pipe and at a terminal; it always ends safely."""

import io
import os
import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from threading import Timer
from time import sleep
from typing import Any

import pytest
from prompt_toolkit import PromptSession
from prompt_toolkit.application import create_app_session, run_in_terminal
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from prompt_toolkit.renderer import Renderer

from machine.cli.cli import main
from machine.cli.commands import console
from machine.cli.commands.console import Shown, _Console
from machine.cli.terminal.interrupts import interrupting
from machine.printing import ports
from machine.printing.command_session import CommandSession
from machine.simulator.record import Record
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load
from tests.machine.peers import happened, hear_out, on_terminal, scripted
from tests.machine.person import Person

MACHINE = load().machine
PROMPT = ">"  # the space after the prompt is a cursor movement
NAMED = {"M115": "FIRMWARE_NAME:Marlin 2.1.2\nok", "M114": "X:0.00 Y:0.00 Z:0.00 A:0.00 C:0.00 E:0.00\nok", "M110": "ok"}
COLD = "ok T:20.00 /0.00 B:20.00 /0.00"
Capsys = pytest.CaptureFixture[str]
Piped = Callable[..., int]
Done = Callable[..., tuple[int, Record]]


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch) -> Piped:
    """Exit code of a console that reads a pipe."""

    def run(text: str, path: str, *options: str) -> int:
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        return main(["console", "--port", path, *options])

    return run


@pytest.fixture
def done(piped: Piped) -> Done:
    """Exit code of a console on a simulated printer, and the printer's record."""

    def run(text: str, *options: str) -> tuple[int, Record]:
        with SimulatedPrinter(MACHINE) as printer:
            return piped(text, printer.path, *options), printer.record

    return run


def test_lines_of_a_pipe_are_sent_and_answers_are_shown(done: Done, capsys: Capsys) -> None:
    code, record = done("G28\n; a remark\n\nG1 X12 F6000\nM400\nM114\n")
    out, err = capsys.readouterr()
    assert (code, record.end[-1, 0]) == (0, 12.0)
    assert "X:12.00 " in out.splitlines()[-2]
    assert out.splitlines()[-1].startswith("ok")
    assert err.splitlines()[0].endswith("axes X Y Z A C, at 115200 baud")


def test_a_klipper_that_has_shut_down_can_be_restarted(piped: Piped, capsys: Capsys) -> None:
    """The simulated Klipper answers M115, M110 and M105 and refuses everything else but the restart."""
    refused = "// MCU 'mcu' shutdown: Timer too close\n// Printer is shutdown\n!! MCU 'mcu' shutdown: Timer too close\nok"
    known = {"M115": "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.13.0", "M110": "ok", "M105": "ok T:0"}
    with on_terminal(scripted({**known, "FIRMWARE_RESTART": "ok\n// Klipper state: Disconnect"}, refused)) as path:
        assert piped("FIRMWARE_RESTART\n", path) == 0
    assert capsys.readouterr().err.splitlines()[-1] == (
        "the printer restarts, its heaters are off: the next console or print waits until it is ready"
    )


def test_an_empty_pipe_is_no_error(done: Done, capsys: Capsys) -> None:
    assert done("")[0] == 0
    assert capsys.readouterr().out == ""


def test_a_command_that_the_printer_does_not_know_is_exit_1_at_the_end(done: Done, capsys: Capsys) -> None:
    code, record = done("G28\nM9999 S1\nG1 X5 F6000\n")
    assert (code, record.end[-1, 0]) == (1, 5.0)
    assert capsys.readouterr().err.splitlines()[-1] == "tiltprint: the printer did not know 'M9999 S1'"


@pytest.mark.parametrize(("line", "words"), [
    ("G1 Xö", "the line holds the character 'ö': only printable ASCII can be sent"),
    ("G1 X1*33", "the line ('G1 X1*33') holds a '*'"),
    ("M110 N5", "the line holds M110"),
])  # fmt: skip
def test_a_line_that_cannot_be_sent_is_a_sentence(done: Done, capsys: Capsys, line: str, words: str) -> None:
    code, record = done(f"M104 S200\n{line}\nG28\n")
    assert (code, record.nozzle_target_c, happened(record, "homed XYZAC")) == (1, 0.0, False)
    assert words in capsys.readouterr().err.splitlines()[-1]


def test_heaters_are_switched_off_on_leaving_and_that_is_said(done: Done, capsys: Capsys) -> None:
    code, record = done("M104 S200\nM140 S60\n")
    assert (code, record.nozzle_target_c, record.bed_target_c) == (0, 0.0, 0.0)
    assert happened(record, "nozzle 200")
    assert "switched off: nozzle set to 200 °C and bed set to 60 °C" in capsys.readouterr().err


def test_heaters_stay_on_when_requested(done: Done, capsys: Capsys) -> None:
    code, record = done("M104 S200\n", "--leave-heaters")
    assert (code, record.nozzle_target_c) == (0, 200.0)
    assert "left on: nozzle set to 200 °C" in capsys.readouterr().err


@pytest.mark.parametrize("line", ["/stop", "M112", "M112 ; now"])
def test_the_emergency_stop_halts_the_printer(done: Done, capsys: Capsys, line: str) -> None:
    code, record = done(f"M104 S200\n{line}\nG28\n")
    assert (code, record.nozzle_target_c, happened(record, "M112")) == (1, 0.0, True)
    assert "emergency stop: the printer has halted" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "shown"), [((), True), (("--no-reports",), False)])
def test_temperature_reports_can_be_hidden(piped: Piped, capsys: Capsys, options: tuple[str, ...], shown: bool) -> None:
    words = NAMED | {"M105": COLD, "M400": " T:20.00 /0.00 B:20.00 /0.00\nok"}
    with on_terminal(scripted(words)) as path:
        assert piped("M400\nM105\n", path, *options) == 0
    out = capsys.readouterr().out.splitlines()
    assert (" T:20.00 /0.00 B:20.00 /0.00" in out) is shown
    assert COLD in out


def test_a_printer_error_is_reported_in_its_own_words(piped: Piped, capsys: Capsys) -> None:
    with on_terminal(scripted(NAMED | {"M105": COLD, "G28": "Error:Homing failed, printer halted"})) as path:
        assert piped("G28\nG1 X1\n", path) == 1
    assert "Homing failed, printer halted" in capsys.readouterr().err.splitlines()[-1]


def test_a_port_where_no_printer_is_gets_the_sentence_of_print(
    piped: Piped, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    hear_out(monkeypatch, ports)
    with on_terminal(lambda data, baud: data) as path:
        assert piped("G28\n", path) == 1
    assert f"the device at {path} is not a printer: it sends back what it receives" in capsys.readouterr().err


@pytest.mark.parametrize(("options", "words"), [
    (("--sim-speed", "-1"), "--sim-speed is -1: it must be 0 (as fast as possible) or a number above"),
    (("--log", "/nowhere/a.log"), "the folder /nowhere does not exist"),
    (("--baud", "7"), "baud rate 7 is not possible"),
])  # fmt: skip
def test_a_senseless_option_is_one_sentence(piped: Piped, capsys: Capsys, options: tuple[str, ...], words: str) -> None:
    assert piped("", "sim", *options) == 1
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1


def test_a_user_types_gets_help_and_exits_with_ctrl_d() -> None:
    with Person("console", "--port", "sim") as person:
        person.see(PROMPT)
        person.press("M114\n")
        person.see("X:-160.00 Y:-160.00")
        person.see(PROMPT)
        person.press("/help\n")
        person.see("/stop     emergency stop (M112) at once")
        person.press("/fly\n")
        person.see("/fly is not known: /help, /reports, /stop and /quit are")
        person.see(PROMPT)  # while no prompt reads the terminal, an end of input is ignored
        person.press("\x04")
        assert person.end() == 0
    assert "\x1b[2mok" in person.raw


def test_a_line_that_comes_just_as_the_prompt_begins_is_written_by_the_prompt(capsys: Capsys) -> None:
    shown, early = Shown(reports=False), []

    class Late(PromptSession[str]):
        def prompt(self, *arguments: Any, **options: Any) -> str:
            shown.write("ok")  # written now, it would follow the prompt on its line, and no new prompt would be shown
            early.append(capsys.readouterr().out)
            line = super().prompt(*arguments, **options)
            early.append(capsys.readouterr().out)
            return line

    with create_pipe_input() as keys, create_app_session(keys, DummyOutput()):
        keys.send_text("M114\n")
        assert _Console(None, shown, False)._read_line(Late()) == "M114"
    assert early == ["", "ok\n"]


def test_a_user_is_asked_about_heaters_that_are_on() -> None:
    with Person("console", "--port", "sim") as person:
        person.see(PROMPT)
        person.press("M104 S200\n")
        person.see("ok")
        person.press("/quit\n")
        person.see("nozzle set to 200 °C: switch off? [Y/n] ")
        person.press("n\n")
        person.see("left on: nozzle set to 200 °C")
        assert person.end() == 0


def test_ctrl_c_while_the_printer_heats_leaves_with_the_heaters_off() -> None:
    with Person("console", "--port", "sim", "--sim-speed", "2") as person:
        person.see(PROMPT)
        person.press("M109 S200\n")
        person.see("W:?")  # by now the prompt waits for keys
        person.see("W:?")
        person.press("\x03")
        person.see("switched off: heaters, because a command was running")
        assert person.end() == 130


def test_a_stop_is_obeyed_while_the_printer_heats() -> None:
    with Person("console", "--port", "sim", "--sim-speed", "2") as person:
        person.see(PROMPT)
        person.press("M109 S200\n")
        person.see(PROMPT)
        person.press("/stop\n")
        person.see("emergency stop: the printer has halted")
        assert person.end() == 1


def test_a_disconnected_printer_ends_the_console_without_a_key_press() -> None:
    with ExitStack() as stack:
        path = stack.enter_context(on_terminal(scripted(NAMED | {"M105": COLD})))
        with Person("console", "--port", path) as person:
            person.see(PROMPT)
            stack.close()
            person.see(f"the connection at {path} was lost")
            assert person.end() == 1


def test_an_interrupt_while_a_line_is_put_above_the_prompt_ends_the_prompt(monkeypatch: pytest.MonkeyPatch) -> None:
    erase, late = Renderer.erase, []

    def interrupted(self: Renderer, leave_alternate_screen: bool = True) -> None:
        monkeypatch.setattr(Renderer, "erase", erase)
        signal.raise_signal(signal.SIGTERM)
        erase(self, leave_alternate_screen)

    def hang() -> None:
        late.append("the prompt waits for ever")
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(Renderer, "erase", interrupted)
    with create_pipe_input() as keys:
        prompt: PromptSession[str] = PromptSession(input=keys, output=DummyOutput())
        line, alarm = Timer(0.5, lambda: prompt.app.loop.call_soon_threadsafe(run_in_terminal, print)), Timer(20.0, hang)
        line.start()
        alarm.start()
        with interrupting(), pytest.raises(KeyboardInterrupt):
            _Console(None, Shown(reports=False), False)._read_line(prompt)
        alarm.cancel()
    assert Renderer.erase is erase
    assert not late


def test_the_end_of_a_closed_terminal_that_comes_before_its_signal_is_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    console = _Console(None, None, False)
    monkeypatch.setattr(sys, "stdin", io.StringIO())  # like a closed terminal, which is no longer a tty

    def at_end(_prompt: object) -> str:
        raise EOFError

    monkeypatch.setattr(console, "_read_line", at_end)
    with pytest.raises(KeyboardInterrupt):
        console._read_on(None)


def test_a_bug_while_a_line_is_sent_ends_the_console_with_the_heaters_off(
    monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    command = CommandSession.command

    def planted(self: CommandSession, line: str) -> None:
        if line == "M503":
            raise ZeroDivisionError("planted")
        command(self, line)

    monkeypatch.setattr(sys, "stdin", Terminal())
    monkeypatch.setattr(CommandSession, "command", planted)
    with SimulatedPrinter(MACHINE) as printer, create_pipe_input() as keys:
        prompt: PromptSession[str] = PromptSession(input=keys, output=DummyOutput())
        monkeypatch.setattr(console, "_prompt_session", lambda: prompt)
        keys.send_text("M104 S200\nM503\n")
        later = Timer(10.0, keys.send_text, ("/quit\n",))  # not reached if the console ends by itself
        later.start()
        code = main(["console", "--port", printer.path])
        later.cancel()
        assert (code, printer.record.nozzle_target_c) == (3, 0.0)
        assert happened(printer.record, "nozzle 200")
    assert "ZeroDivisionError: planted; the printer reports its heaters off" in capsys.readouterr().err


@pytest.mark.parametrize("after_s", [0.002, 0.6])  # while the answer is being put above the prompt, or at rest
def test_a_closed_terminal_leaves_with_the_heaters_off(after_s: float) -> None:
    with SimulatedPrinter(MACHINE) as printer:
        with Person("console", "--port", printer.path) as person:
            person.see(PROMPT)
            person.press("M104 S200\nM503\nM115\nM114\n")
            person.see("ok")
            sleep(after_s)
            assert person.hang_up() == 130
        assert (happened(printer.record, "nozzle 200"), printer.record.nozzle_target_c) == (True, 0.0)


def test_busy_lines_in_a_row_are_folded(capsys: Capsys) -> None:
    shown = Shown(reports=False)
    shown.quiet = False
    shown.hear(b"echo:busy: processing\n" * 15 + b"ok\necho:busy: processing\nok\n")
    assert capsys.readouterr().out.splitlines() == [
        "echo:busy: processing",
        "(busy 14 more times)",
        "ok",
        "echo:busy: processing",
        "ok",
    ]

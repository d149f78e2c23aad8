"""Keys during a print, here or on a server: the command of each key, and a terminal that is restored afterwards."""

import os
import pty
import sys
import termios
import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest

from machine.cli.terminal import keys as keys_module
from machine.cli.terminal.keys import ALONE_S, CANCELLING, HINT_S, LEAVING, MORE, STOP, STOP_S, SURE, Keyboard, can_type, typing
from machine.link.pending_commands import Command, Control, PendingCommand
from machine.link.print_state import PrintState, PrintStatus
from tests.machine.peers import PATIENCE_S

MOMENT = PrintStatus(elapsed_s=0.0)


def asked(*keys: str, state: str = "printing") -> list[PendingCommand]:
    """The commands that a sequence of keys requests."""
    control = Control()
    board = Keyboard(control)
    board.follow(replace(MOMENT, state=PrintState(state)))
    for key in keys:
        board.press(key)
    return list(iter(control.take, None))


def hint_after(*keys: str) -> str:
    board = Keyboard(Control())
    for key in keys:
        board.press(key)
    return board.hint


@pytest.mark.parametrize(("key", "state", "wish"), [
    ("p", "printing", Command.PAUSE),
    ("P", "printing", Command.PAUSE),
    ("r", "paused", Command.RESUME),
    (" ", "printing", Command.PAUSE),
    (" ", "paused", Command.RESUME),
    (" ", "pausing", Command.RESUME),
])  # fmt: skip
def test_a_key_asks_for_its_wish_at_once(key: str, state: str, wish: Command) -> None:
    assert asked(key, state=state) == [PendingCommand(wish)]


@pytest.mark.parametrize("keys", ["", "x", "\x1b", "q", "?", "1", "\r", "c", "cx", "cp", "c "])
def test_other_keys_and_an_unsure_cancel_ask_for_nothing(keys: str) -> None:
    assert asked(*keys) == []


@pytest.mark.parametrize("keys", ["cc", "cy", "CY"])
def test_cancelling_asks_for_confirmation(keys: str) -> None:
    assert hint_after(keys[0]) == SURE
    assert asked(*keys) == [PendingCommand(Command.CANCEL)]


def test_an_unanswered_question_expires() -> None:
    control, clock = Control(), [0.0]
    board = Keyboard(control, now_s=lambda: clock[0])
    board.press("c")
    clock[0] = HINT_S
    assert board.hint == ""
    board.press("c")
    assert (board.hint, control.take()) == (SURE, None)


def test_an_expired_question_whether_to_leave_does_not_change_the_answers_to_the_next_one() -> None:
    control, clock = Control(), [0.0]
    board = Keyboard(control, "moonraker:box", now_s=lambda: clock[0])
    board.press("q")
    clock[0] = HINT_S
    board.press("c")
    assert board.hint == CANCELLING  # c or y cancels
    board.press("y")
    assert (control.take(), board.left()) == (PendingCommand(Command.CANCEL), False)


def test_the_question_disappears_when_answered() -> None:
    assert hint_after("c", "n") == ""


def test_an_emergency_stop_is_never_an_answer_to_a_question() -> None:
    assert asked("c", "e", "e") == [PendingCommand(Command.EMERGENCY_STOP)]


def test_an_emergency_stop_is_two_presses_within_a_second() -> None:
    assert asked("e", "E", state="paused") == [PendingCommand(Command.EMERGENCY_STOP)]
    control, clock = Control(), [0.0]
    board = Keyboard(control, now_s=lambda: clock[0])
    board.press("e")
    assert board.hint == STOP
    clock[0] = STOP_S + 0.1
    board.press("e")
    assert control.take() is None


def test_q_is_explained() -> None:
    assert hint_after("q") == MORE


@pytest.mark.parametrize(("keys", "percent"), [
    ("+", [110.0]), ("++", [110.0, 120.0]), ("=", [110.0]), ("-", [90.0]), ("+-", [110.0, 100.0]), ("_", [90.0]),
])  # fmt: skip
def test_the_feed_changes_in_steps(keys: str, percent: list[float]) -> None:
    assert asked(*keys) == [PendingCommand(Command.FEED, value) for value in percent]


def test_u_and_d_shift_z_by_a_hundredth_of_a_millimetre() -> None:
    assert asked("u", "d") == [PendingCommand(Command.BABYSTEP, 0.01), PendingCommand(Command.BABYSTEP, -0.01)]


def test_steps_begin_at_what_the_program_has_set() -> None:
    control = Control()
    board = Keyboard(control)
    board.follow(replace(MOMENT, feed_percent=50.0, flow_percent=95.0))
    board.press("+")
    board.press("]")
    assert [control.take(), control.take()] == [PendingCommand(Command.FEED, 60.0), PendingCommand(Command.FLOW, 105.0)]


def test_overrides_stay_inside_what_the_stream_takes() -> None:
    assert asked(*"-" * 50)[-1] == PendingCommand(Command.FEED, 10.0)
    assert asked(*"+" * 50)[-1] == PendingCommand(Command.FEED, 300.0)
    assert asked(*"]" * 50)[-1] == PendingCommand(Command.FLOW, 200.0)
    assert asked(*"[" * 50)[-1] == PendingCommand(Command.FLOW, 10.0)


class Pressed:
    """Keys as they arrive; wait_for() returns once there are enough."""

    def __init__(self) -> None:
        self.keys = ""
        self._more = threading.Condition()

    def __call__(self, key: str) -> None:
        with self._more:
            self.keys += key
            self._more.notify()

    def wait_for(self, count: int) -> str:
        with self._more:
            self._more.wait_for(lambda: len(self.keys) >= count, PATIENCE_S)
        return self.keys


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A terminal as stdin; its other end receives the keys that the test presses."""
    fingers, terminal = pty.openpty()
    with os.fdopen(terminal, "r") as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield fingers
    os.close(fingers)


def test_keys_are_read_as_they_are_pressed_and_escape_sequences_are_ignored(keyboard: int) -> None:
    pressed = Pressed()
    with typing(pressed):
        os.write(keyboard, b"p")
        assert pressed.wait_for(1) == "p"
        os.write(keyboard, b"\x1b[C\x1bOP\x1b[15~r")
        assert pressed.wait_for(2) == "pr"


@pytest.mark.parametrize(("begin", "rest"), [(b"p\x1b", b"[Cr"), (b"p\x1b[", b"Cr"), (b"p\x1bO", b"Pr"), (b"p\x1b[15", b"~r")])
def test_an_arrow_that_comes_in_pieces_is_no_key_either(keyboard: int, begin: bytes, rest: bytes) -> None:
    pressed = Pressed()
    with typing(pressed):
        os.write(keyboard, begin)
        assert pressed.wait_for(1) == "p"
        os.write(keyboard, rest)
        assert pressed.wait_for(2) == "pr"


def test_ctrl_c_still_interrupts_and_ctrl_z_does_nothing(keyboard: int) -> None:
    with typing(Pressed()):
        settings = termios.tcgetattr(sys.stdin.fileno())
    assert not settings[3] & (termios.ICANON | termios.ECHO)
    assert settings[3] & termios.ISIG
    assert settings[6][termios.VSUSP] == b"\x00"


def _interrupted() -> None:
    with typing(Pressed()):
        raise KeyboardInterrupt


def test_the_terminal_is_restored_after_an_interrupt(keyboard: int) -> None:
    before = termios.tcgetattr(sys.stdin.fileno())
    with pytest.raises(KeyboardInterrupt):
        _interrupted()
    assert termios.tcgetattr(sys.stdin.fileno()) == before


def test_no_thread_is_left(keyboard: int) -> None:
    before = set(threading.enumerate())
    with typing(Pressed()):
        pass
    assert set(threading.enumerate()) <= before


def test_a_closed_terminal_ends_the_key_reader_without_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    fingers, terminal = pty.openpty()
    with os.fdopen(terminal, "r") as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with typing(Pressed()):
            reader = next(thread for thread in threading.enumerate() if thread.name == "keys")
            os.close(fingers)
            reader.join(PATIENCE_S)
            assert not reader.is_alive()


class Console:
    """Windows' module msvcrt with typed keys."""

    def __init__(self, typed: str) -> None:
        self._typed = list(typed)

    def kbhit(self) -> bool:
        return bool(self._typed)

    def getwch(self) -> str:
        return self._typed.pop(0)


def test_without_termios_keys_are_read_from_the_windows_console(monkeypatch: pytest.MonkeyPatch, keyboard: int) -> None:
    monkeypatch.setitem(sys.modules, "msvcrt", Console("p\xe0Kr\x00;+"))
    monkeypatch.setitem(sys.modules, "termios", None)
    pressed = Pressed()
    assert can_type()
    with typing(pressed):
        assert pressed.wait_for(3) == "pr+"


def test_if_keys_cannot_be_read_none_are_offered(monkeypatch: pytest.MonkeyPatch, keyboard: int) -> None:
    monkeypatch.setitem(sys.modules, "termios", None)
    assert not can_type()


def test_keys_are_read_from_a_terminal_in_the_foreground_only(keyboard: int) -> None:
    assert not can_type()  # a terminal, but not the one that controls this process


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def board_and_control(monkeypatch: pytest.MonkeyPatch, terminal: bool = True) -> tuple[Keyboard, Control, Clock]:
    monkeypatch.setattr(keys_module, "can_type", lambda: terminal)
    monkeypatch.setattr(keys_module, "is_terminal", lambda: terminal)
    control, clock = Control(), Clock()
    return Keyboard(control, "octoprint:octopi", clock), control, clock


def commands_of(control: Control) -> list[Command]:
    requests = iter(control.take, None)
    return [request.command for request in requests]


@pytest.mark.parametrize(
    ("keys", "commands", "left"),
    [
        ("pr", [Command.PAUSE, Command.RESUME], False),
        ("ee", [Command.EMERGENCY_STOP], False),
        ("e", [], False),
        ("cy", [Command.CANCEL], False),
        ("cc", [Command.CANCEL], False),
        ("cn", [], False),
        ("ql", [], True),
        ("qc", [Command.CANCEL], False),
        ("qx", [], False),
        ("l", [], False),
    ],
)
def test_keys_work_as_at_a_port_and_l_leaves_when_asked(
    keys: str, commands: list[Command], left: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    board, control, _ = board_and_control(monkeypatch)
    for key in keys:
        board.press(key)
    assert (commands_of(control), board.left()) == (commands, left)


def test_the_first_ctrl_c_asks_the_second_cancels_the_third_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, _ = board_and_control(monkeypatch)
    board.interrupt()
    assert (board.hint, commands_of(control)) == (LEAVING, [])
    board.interrupt()
    assert commands_of(control) == [Command.CANCEL]
    assert not board.left()
    with pytest.raises(KeyboardInterrupt):
        board.interrupt()


def test_any_key_after_ctrl_c_continues_following(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, clock = board_and_control(monkeypatch)
    board.interrupt()
    board.press("x")
    clock.now_s = 100.0
    assert not board.left()
    board.press("c")
    assert board.hint == CANCELLING
    assert commands_of(control) == []


def test_an_unanswered_question_leaves_the_print_running(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, clock = board_and_control(monkeypatch)
    board.interrupt()
    clock.now_s = 9.9
    assert not board.left()
    clock.now_s = 10.1
    assert board.left()
    assert commands_of(control) == []


def test_without_a_terminal_the_output_explains_how_to_cancel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    board, control, clock = board_and_control(monkeypatch, terminal=False)
    board.interrupt()
    assert capsys.readouterr().err == "the print continues at octoprint:octopi: interrupt again within 2 s to cancel it\n"
    clock.now_s = ALONE_S - 0.1
    board.interrupt()
    assert commands_of(control) == [Command.CANCEL]

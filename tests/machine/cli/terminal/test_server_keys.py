"""Keys and Ctrl-C while a server prints: what each press means, and that an unanswered question leaves the print alone."""

import pytest

from machine.cli.terminal import server_keys
from machine.cli.terminal.server_keys import ALONE_S, CANCELLING, LEAVING, ServerKeyboard
from machine.link.pending_commands import Command, Control


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def board_and_control(monkeypatch: pytest.MonkeyPatch, terminal: bool = True) -> tuple[ServerKeyboard, Control, Clock]:
    monkeypatch.setattr(server_keys, "can_type", lambda: terminal)
    monkeypatch.setattr(server_keys, "is_terminal", lambda: terminal)
    control, clock = Control(), Clock()
    return ServerKeyboard(control, "octoprint:octopi", clock), control, clock


def asked(control: Control) -> list[Command]:
    requests = iter(control.take, None)
    return [request.command for request in requests]


@pytest.mark.parametrize(
    ("keys", "commands", "gone"),
    [
        ("pr", [Command.PAUSE, Command.RESUME], False),
        ("e", [Command.EMERGENCY_STOP], False),
        ("cy", [Command.CANCEL], False),
        ("cc", [Command.CANCEL], False),
        ("cn", [], False),
        ("ql", [], True),
        ("qc", [Command.CANCEL], False),
        ("qx", [], False),
        ("l", [], False),
    ],
)
def test_keys_mean_what_they_mean_at_a_port_and_l_leaves_when_asked(
    keys: str, commands: list[Command], gone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    board, control, _ = board_and_control(monkeypatch)
    for key in keys:
        board.press(key)
    assert (asked(control), board.gone()) == (commands, gone)


def test_the_first_ctrl_c_asks_the_second_cancels_the_third_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, _ = board_and_control(monkeypatch)
    board.interrupt()
    assert (board.hint, asked(control)) == (LEAVING, [])
    board.interrupt()
    assert asked(control) == [Command.CANCEL]
    assert not board.gone()
    with pytest.raises(KeyboardInterrupt):
        board.interrupt()


def test_any_key_after_ctrl_c_goes_on_following(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, clock = board_and_control(monkeypatch)
    board.interrupt()
    board.press("x")
    clock.now_s = 100.0
    assert not board.gone()
    board.press("c")
    assert board.hint == CANCELLING
    assert asked(control) == []


def test_a_question_that_nobody_answers_leaves_the_print_going_on(monkeypatch: pytest.MonkeyPatch) -> None:
    board, control, clock = board_and_control(monkeypatch)
    board.interrupt()
    clock.now_s = 9.9
    assert not board.gone()
    clock.now_s = 10.1
    assert board.gone()
    assert asked(control) == []


def test_without_a_terminal_the_way_to_cancel_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    board, control, clock = board_and_control(monkeypatch, terminal=False)
    board.interrupt()
    assert capsys.readouterr().err == "the print goes on at octoprint:octopi: interrupt again within 2 s to cancel it\n"
    clock.now_s = ALONE_S - 0.1
    board.interrupt()
    assert asked(control) == [Command.CANCEL]

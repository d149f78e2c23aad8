"""The page of a running print: access control, its values, and its end with the print."""

import http.client
import json
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from http.client import HTTPResponse
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.link.pending_commands import Command, Control, PendingCommand
from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.events import Temperature
from machine.view.serving.watch_page import Watched, serve
from profiles.errors import OutputError
from tests.machine.pages import opened
from tests.machine.peers import PATIENCE_S

HALF = PrintStatus(
    sent=60, acknowledged=50, total=100, elapsed_s=10.0, left_s=9.5, share=0.5,
    temperature=Temperature(nozzle_c=209.5, nozzle_target_c=210.0), part=2, parts=3, layer=7, file_line=123,
)  # fmt: skip


@pytest.fixture
def control() -> Control:
    return Control()


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch, control: Control) -> Iterator[Watched]:
    monkeypatch.setattr("machine.view.serving.watch_page.LAST_WORD_S", 0.0)
    with serve(b"<p>the page</p>", control=control) as running:
        yield running


def port_of(watched: Watched) -> int:
    return int(watched.address.split(":")[2].split("/")[0])


def asked(watched: Watched, path: str, method: str = "GET", **headers: str) -> tuple[HTTPResponse, bytes]:
    """The server's answer to a path below the secret address."""
    return asked_without_token(watched, f"/{watched.token}{path}", method, **headers)


def asked_without_token(watched: Watched, path: str, method: str = "GET", **headers: str) -> tuple[HTTPResponse, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port_of(watched), timeout=PATIENCE_S)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


def ordered(watched: Watched, name: str, method: str = "POST", **headers: str) -> int:
    """Status of a request from the print's own page."""
    own = {"Origin": f"http://127.0.0.1:{port_of(watched)}"}
    return asked(watched, f"/order/{name}", method, **own | headers)[0].status


def test_the_page_and_the_state_are_served(watched: Watched) -> None:
    assert asked(watched, "/")[1] == b"<p>the page</p>"
    assert json.loads(asked(watched, "/state")[1])["state"] == "checking"
    watched.follow(HALF)
    state = json.loads(asked(watched, "/state")[1])
    assert (state["state"], state["file_line"], state["acknowledged"], state["total"]) == ("printing", 123, 50, 100)
    assert (state["nozzle_c"], state["nozzle_target_c"], state["bed_c"]) == (209.5, 210.0, None)


@pytest.mark.parametrize("path", ["/etc/passwd", "/../state", "/state/", "/favicon.ico"])
def test_other_paths_return_404(watched: Watched, path: str) -> None:
    assert asked(watched, path)[0].status == 404


@pytest.mark.parametrize("path", ["/", "/state", "/AAAAAAAAAAAAAAAAAAAAAA/", "/AAAAAAAAAAAAAAAAAAAAAA/state", "//state"])
def test_without_the_token_of_the_address_nothing_is_shown(watched: Watched, path: str) -> None:
    answer, content = asked_without_token(watched, path)
    assert (answer.status, content) == (
        404,
        b"open the address that tiltprint printed at its start: it changes each time\n",
    )


def test_every_print_has_another_token(watched: Watched) -> None:
    assert len(watched.token) >= 22
    assert Watched(b"").token != watched.token


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("pause", Command.PAUSE),
        ("resume", Command.RESUME),
        ("cancel", Command.CANCEL),
        ("emergency", Command.EMERGENCY_STOP),
    ],
)
def test_a_button_asks_of_the_print_what_a_key_does(watched: Watched, control: Control, name: str, command: Command) -> None:
    assert ordered(watched, name) == 204
    assert control.take() == PendingCommand(command)


@pytest.mark.parametrize(
    ("name", "method", "headers", "status"),
    [
        ("pause", "GET", {}, 405),
        ("pause", "PUT", {}, 405),
        ("line", "POST", {}, 404),
        ("pause", "POST", {"Origin": "http://evil.example"}, 403),
        ("pause", "POST", {"Origin": "null"}, 403),
        ("pause", "POST", {"Host": "evil.example"}, 403),
    ],
)
def test_only_known_commands_of_the_own_page_are_accepted(
    watched: Watched, control: Control, name: str, method: str, headers: dict[str, str], status: int
) -> None:
    assert ordered(watched, name, method, **headers) == status
    assert control.take() is None


def test_commands_without_token_or_origin_are_refused(watched: Watched, control: Control) -> None:
    own = {"Origin": f"http://127.0.0.1:{port_of(watched)}"}
    assert asked_without_token(watched, "/AAAAAAAAAAAAAAAAAAAAAA/order/pause", "POST", **own)[0].status == 404
    assert asked(watched, "/order/pause", "POST")[0].status == 403
    assert control.take() is None


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("localhost:{port}", 200), ("127.0.0.1:{port}", 200), ("localhost", 403), ("127.0.0.1:1", 403),
        ("evil.example", 403), ("evil.example:{port}", 403), ("127.0.0.1.evil.example:{port}", 403),
        ("", 403), ("[::1]:{port}", 403),
    ],
)  # fmt: skip
def test_only_this_computer_by_name_is_answered(watched: Watched, host: str, status: int) -> None:
    answer, content = asked(watched, "/state", Host=host.format(port=port_of(watched)))
    assert answer.status == status
    assert (b"checking" in content) == (status == 200)


def test_no_other_page_may_frame_it_or_keep_it(watched: Watched) -> None:
    answer, _ = asked(watched, "/")
    assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
    assert answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["Access-Control-Allow-Origin"] is None


def test_a_dropped_connection_does_not_disturb_the_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("machine.view.serving.watch_page.LAST_WORD_S", 0.0)
    with serve(b"x" * 20_000_000) as running:
        port = port_of(running)
        for _ in range(3):
            with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as rude:
                rude.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                rude.sendall(f"GET /{running.token}/ HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n".encode())
                rude.recv(10)
        assert asked(running, "/state")[0].status == 200
    assert capfd.readouterr().err == ""


def test_it_listens_on_this_computer_only(watched: Watched) -> None:
    assert watched.address.startswith("http://127.0.0.1:")
    port = port_of(watched)
    with pytest.raises(OSError, match=r"refused|unreachable"), socket.create_connection(("127.0.0.2", port), timeout=PATIENCE_S):
        pass


def test_a_port_in_use_is_refused_with_a_sentence(watched: Watched) -> None:
    port = port_of(watched)
    with pytest.raises(OutputError, match=rf"--watch-port {port} cannot be used: address already in use"), serve(b"", port):
        pass


def test_the_server_ends_with_the_print() -> None:
    with serve(b"page") as running:
        port = port_of(running)
    with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S):
        pass


def test_a_failed_print_is_shown_as_failed() -> None:
    def failing() -> Iterator[Watched]:
        with serve(b"page") as running:
            yield running
            raise KeyboardInterrupt

    print_ = failing()
    running = next(print_)
    with pytest.raises(KeyboardInterrupt):
        next(print_)
    assert json.loads(running.state())["state"] == "failed"


def test_a_warning_is_shown_as_long_as_the_print_lasts() -> None:
    watched = Watched(b"")
    watched.follow(replace(HALF, warning="this print can no longer be resumed"))
    assert json.loads(watched.state())["warning"] == "this print can no longer be resumed"


def test_the_outcome_is_shown_once() -> None:
    watched = Watched(b"")
    watched.follow(HALF)
    watched.end(PrintState.CANCELLED)
    watched.end(PrintState.DONE)
    state = json.loads(watched.state())
    assert (state["state"], state["file_line"], state["heat_is_old"]) == ("cancelled", 123, True)


def test_print_watch_follows_the_print_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pages: list[Watched] = []

    @contextmanager
    def remembered(page: bytes, port: int, control: Control) -> Iterator[Watched]:
        with serve(page, port, control) as running:
            pages.append(running)
            yield running

    monkeypatch.setattr("machine.view.serving.watch_page.serve", remembered)
    file = tmp_path / "moves.gcode"
    file.write_text("G28\nM109 S200\nG1 Z0.2 F6000\nG1 X10 E1\nG1 Y10 E2\nM104 S0\nM140 S0\n")
    assert main(["print", str(file), "--port", "sim", "--watch", "--no-browser", "--force"]) == 0
    state, (header, _) = json.loads(pages[0].state()), opened(pages[0].page)
    assert (state["state"], state["acknowledged"], state["total"]) == ("done", 7, 7)
    assert header["live"] is True
    assert f"watch the print at {pages[0].address}" in capsys.readouterr().err


@pytest.mark.parametrize(("more", "opened_in"), [((), 1), (("--no-browser",), 0)])
def test_print_watch_opens_the_browser_unless_disabled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, more: tuple[str, ...], opened_in: int
) -> None:
    monkeypatch.setattr("machine.view.serving.watch_page.LAST_WORD_S", 0.0)
    shown: list[str] = []
    monkeypatch.setattr("machine.view.serving.watch_page.lead_browser", lambda address, until_end: shown.append(address))
    file = tmp_path / "moves.gcode"
    file.write_text("G28\nM109 S200\nG1 Z0.2 F6000\nG1 X10 E1\nM104 S0\nM140 S0\n")
    assert main(["print", str(file), "--port", "sim", "--watch", "--force", *more]) == 0
    assert len(shown) == opened_in

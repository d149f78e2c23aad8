"""The real servers, if they are installed; environment variables name the programs.

TILTPRINT_OCTOPRINT=/path/to/octoprint          with its own virtual printer (pip install OctoPrint==1.11.8)
TILTPRINT_MOONRAKER=/path/to/moonraker          with a stub of Klipper's API server (pip install moonraker==0.11.0)

Each server needs its own Python environment.
"""

import os
import socket
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.printing.servers.follow import Follower
from machine.printing.servers.http import VARIABLE
from machine.printing.servers.server import GcodeUpload
from profiles.errors import ServerError
from tests.machine.printing.servers.klippy_stub import KlippyStub
from tests.machine.printing.servers.stand_ins import session_with

OCTOPRINT, MOONRAKER = os.environ.get("TILTPRINT_OCTOPRINT", ""), os.environ.get("TILTPRINT_MOONRAKER", "")
KEY = "0123456789ABCDEF0123456789ABCDEF"
PASSES = tuple(f"G1 X{20 * (k % 2)} Y{k % 20} F6000" for k in range(400))
UPLOAD = GcodeUpload("passes.gcode", ("G28", *PASSES))
OCTOPRINT_SETTINGS = f"""
api: {{key: {KEY}}}
server: {{firstRun: false, onlineCheck: {{enabled: false}}, pluginBlacklist: {{enabled: false}}}}
plugins:
  virtual_printer: {{enabled: true}}
  _disabled: [softwareupdate, tracking, announcements, discovery, errortracking, backup, pluginmanager]
serial: {{autoconnect: true, port: VIRTUAL, baudrate: 115200, additionalPorts: [VIRTUAL]}}
"""
MOONRAKER_SETTINGS = """
[server]
host: 127.0.0.1
port: {port}
klippy_uds_address: {socket}
[authorization]
enable_api_key: True
[machine]
provider: none
validate_service: False
"""
pytestmark = [pytest.mark.slow]
needs_octoprint = pytest.mark.skipif(not OCTOPRINT, reason="TILTPRINT_OCTOPRINT names no octoprint")
needs_moonraker = pytest.mark.skipif(not MOONRAKER, reason="TILTPRINT_MOONRAKER names no moonraker")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as held:
        return int(held.getsockname()[1])


@contextmanager
def running(words: list[str], log: Path) -> Iterator[None]:
    with log.open("wb") as out:
        process = subprocess.Popen(words, stdout=out, stderr=out)
        try:
            yield
        finally:
            process.terminate()
            process.wait(20)


def wait_ready(address: str) -> None:
    deadline = time.monotonic() + 90
    while True:
        try:
            with session_with(address) as server:
                server.greet()
                if server.status().state is PrintState.READY:
                    return
        except ServerError:
            if time.monotonic() > deadline:
                raise
        assert time.monotonic() < deadline
        time.sleep(0.5)


@pytest.fixture
def octoprint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of an OctoPrint whose virtual printer is connected."""
    monkeypatch.setenv(VARIABLE, KEY)
    base, port = tmp_path / "base", free_port()
    base.mkdir()
    program = [OCTOPRINT, "--basedir", str(base)]
    subprocess.run([*program, "user", "add", "--password", "workshop", "--admin", "maker"], check=True, capture_output=True)
    (base / "config.yaml").write_text(OCTOPRINT_SETTINGS)
    serve = [*program, "serve", "--iknowwhatimdoing", "--host", "127.0.0.1", "--port", str(port)]
    with running(serve, tmp_path / "octoprint.log"):
        address = f"octoprint:127.0.0.1:{port}"
        wait_ready(address)
        yield address


@pytest.fixture
def moonraker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, KlippyStub]]:
    """The address of a Moonraker and the Klipper behind it; the key is the one that Moonraker has generated."""
    for folder in ("config", "gcodes", "logs", "database"):
        (tmp_path / folder).mkdir()
    port, uds = free_port(), tmp_path / "klippy.sock"
    (tmp_path / "config" / "moonraker.conf").write_text(MOONRAKER_SETTINGS.format(port=port, socket=uds))
    with KlippyStub(uds, tmp_path / "gcodes") as klippy, running([MOONRAKER, "-d", str(tmp_path)], tmp_path / "moonraker.log"):
        address = f"moonraker:127.0.0.1:{port}"
        monkeypatch.setenv(VARIABLE, wait_for_key(tmp_path / "database" / "moonraker-sql.db"))
        wait_ready(address)
        yield address, klippy


def wait_for_key(database: Path) -> str:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.5)
        try:
            with sqlite3.connect(f"file:{database}?mode=ro", uri=True) as connection:
                rows = connection.execute("SELECT password FROM authorized_users WHERE username = '_API_KEY_USER_'").fetchall()
        except sqlite3.Error:
            continue
        if rows:
            return str(rows[0][0])
    raise AssertionError("Moonraker has made no key")


Steps = Callable[[PrintStatus, Control], None]


def print_on(address: str, steps: Steps) -> tuple[PrintState, list[PrintState]]:
    """How a print that receives commands ends, and the phases observed."""
    phases: list[PrintState] = []
    control = Control()

    def on_status(status: PrintStatus, message: str) -> None:
        if phases[-1:] != [status.state]:
            phases.append(status.state)
            steps(status, control)

    with session_with(address) as server:
        file = server.upload(UPLOAD, lambda count: None)
        return Follower(server, file, len(UPLOAD.content), on_status=on_status, control=control, left=lambda: False).run(), phases


def pause_resume_cancel() -> Steps:
    orders = {PrintState.PRINTING: [Command.PAUSE, Command.CANCEL], PrintState.PAUSED: [Command.RESUME]}

    def steps(status: PrintStatus, control: Control) -> None:
        if orders.get(status.state):
            control.ask(orders[status.state].pop(0))

    return steps


def only_watch(status: PrintStatus, control: Control) -> None:
    """Request nothing."""


def stop_at_once(status: PrintStatus, control: Control) -> None:
    if status.state is PrintState.PRINTING:
        control.ask(Command.EMERGENCY_STOP)


def check_broken_off(address: str) -> None:
    """An upload that the user interrupts leaves nothing on the server."""
    large = GcodeUpload("broken.gcode", PASSES * 200)

    def interrupt(count: int) -> None:
        if count > 1_000_000:
            raise KeyboardInterrupt

    with session_with(address) as server:
        with pytest.raises(KeyboardInterrupt):
            server.upload(large, interrupt)
        time.sleep(1.0)
        assert not server.has("broken.gcode")


def check_refusals(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "another-key")
    with session_with(address) as server, pytest.raises(ServerError, match="refuses the key"):
        server.greet()
    monkeypatch.setenv(VARIABLE, "")
    with session_with(address) as server, pytest.raises(ServerError, match="wants a key"):
        server.greet()


@needs_octoprint
def test_octoprint_prints_pauses_cancels_and_halts(octoprint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with session_with(octoprint) as server:
        assert server.greet().text.startswith("OctoPrint 1.")
        assert not server.has("passes.gcode")
    end, phases = print_on(octoprint, only_watch)
    assert (end, phases[-1]) == (PrintState.DONE, PrintState.DONE)
    with session_with(octoprint) as server:
        assert server.has("passes.gcode")
    check_pause_and_cancel(octoprint)
    check_broken_off(octoprint)
    assert print_on(octoprint, stop_at_once)[0] is PrintState.FAILED
    check_refusals(octoprint, monkeypatch)


@needs_moonraker
def test_moonraker_prints_pauses_cancels_and_halts(moonraker: tuple[str, KlippyStub], monkeypatch: pytest.MonkeyPatch) -> None:
    address, klippy = moonraker
    with session_with(address) as server:
        greeting = server.greet()
        assert greeting.text.startswith("Moonraker")
        assert greeting.limits["Z"] == (-5.0, 400.0)
        assert greeting.steppers == {"stepper_a", "stepper_c"}
        assert not server.has("passes.gcode")
    end, phases = print_on(address, only_watch)
    assert (end, phases[-1]) == (PrintState.DONE, PrintState.DONE)
    with session_with(address) as server:
        assert server.has("passes.gcode")
        server.command("M220 S120")
    assert klippy.scripts[-1] == "M220 S120"
    check_pause_and_cancel(address)
    check_while_printing(address)
    check_broken_off(address)
    assert print_on(address, stop_at_once)[0] is PrintState.FAILED
    with session_with(address) as server:
        assert server.status().state is PrintState.OFFLINE
    check_refusals(address, monkeypatch)


def check_pause_and_cancel(address: str) -> None:
    end, phases = print_on(address, pause_resume_cancel())
    assert end is PrintState.CANCELLED
    begin = [phase for phase in phases if phase in (PrintState.PRINTING, PrintState.PAUSED)][:3]
    assert begin == [PrintState.PRINTING, PrintState.PAUSED, PrintState.PRINTING]


def check_while_printing(address: str) -> None:
    with session_with(address) as server:
        server.start("passes.gcode")
        with pytest.raises(ServerError, match="printing a file of this name now"):
            server.upload(UPLOAD, lambda count: None)
        with pytest.raises(ServerError, match="cannot start it now: SD busy"):
            server.start("passes.gcode")
        server.order(Command.CANCEL)

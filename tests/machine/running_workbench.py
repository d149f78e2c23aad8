"""A running workbench: `tiltprint edit` as a process, its address, and a page of it without a browser."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from machine.workbench.printing.prints import FILE
from profiles.folders import state_folder

PATIENCE_S = 180.0  # the first search on a machine compiles its kernels
COARSE = ("layer_height_mm=0.4", "first_layer_height_mm=0.4", "line_width_mm=0.8")
QUICK = ("--set", "search.directions=60", "--set", "search.beam_width=2", *(f"--set=process.{setting}" for setting in COARSE))
# Otherwise a T with such coarse layers, with much stair-stepping on its arms and short seams, would be printed in one piece.
QUICK += ("--set=search.seam_mm=0.8", "--set=search.stair_weight=0.01", "--set=search.least_saving=0")


class Running:
    """address: as printed at the start; port, place: its port and path."""

    def __init__(self, process: "subprocess.Popen[str]", address: str) -> None:
        self.process, self.address = process, address
        self.port, self.place = urlsplit(address).port, urlsplit(address).path

    def ask(self, path: str, method: str = "GET", body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
        """Status and content of an answer; a path without a leading slash is relative to the token."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request(method, path if path.startswith("/") else self.place + path, body, headers)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content

    def send(self, file: Path) -> tuple[int, bytes]:
        """Send a file as a page of this server does."""
        return self.ask(f"file?name={file.name}", "POST", file.read_bytes(), Origin=f"http://127.0.0.1:{self.port}")

    @contextmanager
    def line(self, origin: str | None = None, path: str | None = None) -> Iterator["Page"]:
        """A page's websocket; origin: of the page, None: this server."""
        address = f"ws://127.0.0.1:{self.port}{self.place if path is None else path}line"
        with connect(address, origin=origin or f"http://127.0.0.1:{self.port}", max_size=None, proxy=None) as socket:
            yield Page(socket)

    def children(self) -> list[int]:
        """The processes that it has started and that still run."""
        listed = subprocess.run(["ps", "-eo", "pid,ppid"], capture_output=True, text=True, check=True).stdout.split()[2:]
        return [int(pid) for pid, parent in zip(listed[::2], listed[1::2], strict=True) if int(parent) == self.process.pid]


class Page:
    """The websocket of a page: the newest state and the messages sent."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.state: dict[str, Any] = json.loads(socket.recv(PATIENCE_S))

    def do(self, command: str, **given: Any) -> None:
        self.say(json.dumps({"do": command, **given}))

    def say(self, text: str | bytes) -> None:
        self._socket.send(text)

    def until(self, condition: Any) -> dict[str, Any]:
        """The first state that fulfils a condition."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition(self.state):
            try:
                self.state = json.loads(self._socket.recv(max(0.0, end_s - time.monotonic())))
            except TimeoutError:
                last = {key: self.state[key] for key in ("problem", "busy", "undo", "parts", "search", "slicing")}
                raise AssertionError(f"that never came, only {last}") from None
        return self.state


class OpenToNetwork(Running):
    """A workbench with --lan. network: its address in the network; `told`: the file with its output at the terminal."""

    def __init__(self, process: "subprocess.Popen[str]", told: Path) -> None:
        assert process.stdout is not None
        super().__init__(process, process.stdout.readline().strip())
        self.network, self.told = process.stdout.readline().strip(), told
        self.host = urlsplit(self.network).hostname or ""

    def code(self) -> str:
        """The pairing code printed last."""
        end_s = time.monotonic() + PATIENCE_S
        while not (codes := re.findall(r"[A-Z2-9]{4}-[A-Z2-9]{4}", self.told.read_text())):
            assert time.monotonic() < end_s
            time.sleep(0.05)
        return str(codes[-1])


@contextmanager
def open_workbench(*arguments: str) -> Iterator[OpenToNetwork]:
    """A running workbench with --lan."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "told"
        with told.open("w") as errors, _running(("--lan", *arguments), errors) as process:
            yield OpenToNetwork(process, told)


@contextmanager
def workbench(*arguments: str, before: str = "") -> Iterator[Running]:
    """`tiltprint edit` with these arguments, ended by Ctrl-C. before: Python code that its process runs first."""
    with _running(arguments, subprocess.DEVNULL, before) as process:
        assert process.stdout is not None
        yield Running(process, process.stdout.readline().strip())


@contextmanager
def _running(arguments: Iterable[str], errors: int | IO[str], before: str = "") -> Iterator["subprocess.Popen[str]"]:
    (state_folder() / FILE).unlink(missing_ok=True)  # another test may have saved its printer
    program = ["-c", f"{before}\nimport sys\nfrom machine.cli.cli import main\nsys.exit(main(sys.argv[1:]))"]
    command = [sys.executable, *(program if before else ["-m", "machine.cli.cli"]), "edit", "--no-browser", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE_S)
        finally:
            process.kill()


def is_there(pid: int) -> bool:
    """Whether a process still runs."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True

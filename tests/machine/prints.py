"""A page's connection to the prints of a running workbench, and the commands in a print's log."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from tests.machine.browser import Browser
from tests.machine.firefox import Firefox
from tests.machine.running_workbench import PATIENCE_S, Running

# Presses e twice on every control of the page and of the print's page in it; messages are counted and not sent.
LETTER_E = """(() => {
  let stops = 0;
  const send = WebSocket.prototype.send, kinds = [new Set(), new Set()];
  WebSocket.prototype.send = (text) => { if (JSON.parse(text).do === 'emergency') stops += 1; };
  for (const page of [document, $('print-page').contentDocument])
    for (const field of page.querySelectorAll('input, textarea, select, button')) {
      const before = stops;
      for (const press of [1, 2])
        field.dispatchEvent(new page.defaultView.KeyboardEvent('keydown', { key: 'e', bubbles: true, cancelable: true }));
      kinds[Math.min(stops - before, 1)].add(field.type);
    }
  WebSocket.prototype.send = send;
  return kinds.map((each) => [...each].sort());
})()"""
ASKS = ("M105", "M114")  # sent at certain times, not at certain lines of the program


class PrintPage:
    """The connection of a page with this name to the prints; `print` is the newest state of the newest print."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.state: dict[str, Any] = {"prints": []}
        self.problem = ""

    @property
    def print(self) -> dict[str, Any]:
        newest: dict[str, Any] = self.state["prints"][-1] if self.state["prints"] else {"state": "", "is_over": False}
        return newest

    def do(self, command: str, **given: Any) -> None:
        self.say(json.dumps({"do": command, **given}))

    def say(self, text: str | bytes) -> None:
        self.problem = ""
        self._socket.send(text)

    def command(self, command: str, **given: Any) -> None:
        """Send a command for the newest print."""
        self.do(command, print=self.print["number"], **given)

    def hear(self, end_s: float) -> None:
        message = json.loads(self._socket.recv(max(0.0, end_s - time.monotonic())))
        if "problem" in message:
            self.problem = message["problem"]
        else:
            self.state = message

    def until(self, condition: Any) -> dict[str, Any]:
        """The first state of the newest print that fulfils a condition."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition(self.print):
            try:
                self.hear(end_s)
            except TimeoutError:
                raise AssertionError(f"that never came, only {self.print}") from None
        return self.print

    def refused(self) -> str:
        """The sentence with which the last request is refused."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.problem:
            self.hear(end_s)
        return self.problem


@contextmanager
def prints_line(running: Running, page: str) -> Iterator[PrintPage]:
    """The connection of a page of a workbench's first session to the prints."""
    address = f"ws://127.0.0.1:{running.port}{running.place}prints?page={page}"
    with connect(address, origin=f"http://127.0.0.1:{running.port}", max_size=None, proxy=None) as socket:  # type: ignore[arg-type]
        yield PrintPage(socket)


def kinds_of_fields(browser: Browser | Firefox) -> tuple[list[str], list[str]]:
    """The kinds of fields that accept the letter e, and those on which it is the emergency stop; only while a print runs."""
    typed, stopping = browser.value(LETTER_E)
    return typed, stopping


def commands_sent(log: Path) -> list[str]:
    """The commands of a log, without line numbers and checksums."""
    sent = re.findall(r"^\S+ > (?:N\d+ )?([^*\n]*)", log.read_text(), re.MULTILINE)
    return [command.strip() for command in sent if command.strip() and not command.startswith(ASKS)]

"""A user at a terminal: a command in its own pseudo-terminal, the keys pressed, and the text shown."""

import codecs
import os
import pty
import re
import select
import signal
import sys
import termios
import time
from pathlib import Path
from types import TracebackType
from typing import Self

ROOT = Path(__file__).parents[2]
ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
PATIENCE_S = 60.0
# As `-m machine.cli.cli`, but with a line of progress, and a query to a server, every tenth of a second.
HASTY = """
import sys
from machine.cli.cli import main
from machine import notices
from machine.printing.servers import follow
notices.PLAIN_EVERY_S = follow.POLL_S = 0.1
sys.exit(main(sys.argv[1:]))
"""


class Person:
    """`with Person("console", "--port", "sim") as person:` see(text), press(keys), end() -> exit code."""

    def __init__(self, *arguments: str, term: str = "xterm-256color") -> None:
        self._command = [sys.executable, "-m", "machine.cli.cli", *arguments]
        self._term = term
        self.raw = ""

    @property
    def seen(self) -> str:
        """All text shown, without colours and cursor moves."""
        return ESCAPES.sub("", self.raw)

    def see(self, text: str) -> None:
        """Wait until this text is shown, after the text seen before."""
        end_s = time.monotonic() + PATIENCE_S
        while (begin := self.seen.find(text, self._looked)) < 0:
            if not self._read() or time.monotonic() > end_s:
                raise AssertionError(f"{text!r} was never seen, only {self.seen[-2000:]!r}")
        self._looked = begin + len(text)

    def press(self, keys: str) -> None:
        """Press keys."""
        os.write(self._terminal, keys.encode())

    def settings(self) -> list[object]:
        """The terminal's settings, as long as a process has it open."""
        return termios.tcgetattr(self._terminal)

    def end(self) -> int:
        """Wait for the command to end; its exit code."""
        end_s = time.monotonic() + PATIENCE_S
        while self._read():
            if time.monotonic() > end_s:
                raise AssertionError(f"it did not end, it showed {self.seen[-2000:]!r}")
        return self._code()

    def hang_up(self) -> int:
        """Close the terminal's window and wait for the command to end; its exit code."""
        os.close(self._terminal)
        self._terminal = -1
        return self._code()

    def _code(self) -> int:
        """The exit code of a command that is about to end."""
        end_s = time.monotonic() + PATIENCE_S
        while not (ended := os.waitpid(self._child, os.WNOHANG))[0]:
            if time.monotonic() > end_s:
                raise AssertionError(f"it left its terminal but did not end, it had shown {self.seen[-2000:]!r}")
            time.sleep(0.02)
        self._child = 0
        return os.waitstatus_to_exitcode(ended[1])

    def _read(self) -> bool:
        """Read the available output; False when the command has ended."""
        if not select.select([self._terminal], [], [], 1.0)[0]:
            return True
        try:
            data = os.read(self._terminal, 65536)
        except OSError:
            return False
        self.raw += self._decoder.decode(data)
        return bool(data)

    def __enter__(self) -> Self:
        self._looked = 0
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")  # a letter may arrive in two pieces
        self._child, self._terminal = pty.fork()
        if self._child == 0:
            os.chdir(ROOT)
            os.execve(sys.executable, self._command, {**os.environ, "TERM": self._term, "COLUMNS": "100", "LINES": "30"})
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._child:
            os.kill(self._child, signal.SIGKILL)
            os.waitpid(self._child, 0)
        if self._terminal >= 0:
            os.close(self._terminal)

"""Calls that succeed, fail, kill their process or last, for workers to import."""

import os
import signal
import time
from pathlib import Path
from typing import Any

from mdp.kernels.workers import Interpreter, tell


def greet(name: str) -> str:
    return f"hello {name}"


def squares(count: int) -> str:
    """Report the first squares."""
    for number in range(count):
        tell(number * number)
    return "all"


def process() -> int:
    return os.getpid()


def wait_for_another() -> None:
    """Report the process id of another process in this session, and wait for it."""
    other = Interpreter("import time; time.sleep(60.0)", leads=False)
    tell(other.process.pid)
    other.process.wait()


def refuse(note: Path) -> None:
    _note(note)
    raise ValueError("not this one")


def unspeakable() -> Any:
    return lambda: None


def die(note: Path, times: int) -> str:
    """Kill its own process the first `times` times."""
    _note(note)
    if note.read_text().count("begun") <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"


def sleep(note: Path) -> None:
    note.with_suffix(".pid").write_text(str(os.getpid()))
    _note(note)
    time.sleep(60.0)


def noise() -> str:
    print("what a call prints")  # noqa: T201 - discarded
    os.write(1, b"and what a library prints")
    return "quiet"


def begin(note: Path) -> str:
    """The content of a note, as soon as it has any."""
    while not (note.exists() and note.read_text()):
        time.sleep(0.02)
    return note.read_text()


def _note(note: Path) -> None:
    with note.open("a") as file:
        file.write("begun ")

"""Running simulators: the simulated printers of this user that run now, for the list of ports.

Each keeps a file in the state folder with its path and a word on what it is, locked as long as it runs: another terminal may
get the path of one that was killed, and must not be written to.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from machine.link.port import SerialDevice
from profiles.files import lock
from profiles.folders import state_folder


@contextmanager
def announced(description: str, path: str) -> Iterator[Callable[[str], None]]:
    """List a simulated printer while it runs; call what is given with a new path of it."""
    try:
        text = (_folder() / str(os.getpid())).open("w", encoding="utf-8")
    except OSError:  # a full disk: it is not listed
        yield lambda now: None
        return
    lock(text.fileno())

    def tell(now: str) -> None:
        with suppress(OSError):
            text.seek(0)
            text.truncate()
            text.write(f"{now}\n{description}\n")
            text.flush()

    tell(path)
    try:
        yield tell
    finally:
        with suppress(OSError):
            Path(text.name).unlink(missing_ok=True)
        with suppress(OSError):
            text.close()


def running_simulators() -> tuple[SerialDevice, ...]:
    """Those that run now, by path; what is left of others is removed."""
    devices = []
    try:
        files = sorted(_folder().iterdir())
    except OSError:
        return ()
    for file in files:
        with suppress(OSError), file.open("r+", encoding="utf-8") as text:
            path, _, description = text.read().partition("\n")
            if path and lock(text.fileno()):  # an empty one is of a simulator that has not locked it yet
                file.unlink(missing_ok=True)
                continue
            if path:
                devices.append(SerialDevice(path, path, description.strip(), ""))
    return tuple(sorted(devices, key=lambda device: device.path))


def _folder() -> Path:
    folder = state_folder() / "simulators"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder

"""Print history: which prints have ended, how, and how long they took, in a file of the state folder.

A print has two lines: one when it begins, one when it ends. A print without the second line was killed or is still running.
"""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from time import time
from typing import Any

from machine.dryrun.dryrun import summary
from machine.link.print_state import PrintState
from machine.pipeline.output import write_bytes
from machine.pipeline.programs import LoadedProgram
from machine.printing.job import End
from profiles.errors import OutputError
from profiles.folders import state_folder

FILE = "prints.jsonl"
MOST_PRINTS = 100  # the newest ones, which pages show
MOST_BYTES = 1 << 18  # of the file, which then keeps the newest prints alone
NOT_PRINTED = (PrintState.DECLINED, PrintState.REFUSED)


def recorded(loaded: LoadedProgram, port: str, act: Callable[[], End]) -> End:
    """Print a program, as `act` does, and keep how that ended. Raises what `act` raises; a print does not fail because its record
    cannot be written."""
    key, end = token_hex(4), End(PrintState.FAILED)
    _append({"key": key, "pid": os.getpid(), "name": loaded.name, "port": port, "begun": time()})
    try:
        end = act()
        return end
    finally:
        filament_m = summary(loaded.program.run)["filament_mm"] / 1000.0 if end.state is PrintState.DONE else None
        _append({"key": key, "outcome": end.state.value, "ended": time(), "filament_m": filament_m})


def past_prints() -> list[dict[str, Any]]:
    """Prints that are over, the newest first: `name`, `port`, `outcome` (a value of PrintState), `begun` (seconds since 1970),
    `seconds` (None where the print was killed) and `filament_m` (None where it did not come to its end)."""
    prints = dict[str, dict[str, Any]]()
    for record in _records():
        prints.setdefault(record["key"], {}).update(record)
    return [past for record in reversed(prints.values()) if (past := _past(record)) is not None][:MOST_PRINTS]


def _past(record: dict[str, Any]) -> dict[str, Any] | None:
    """A print as pages get it; None for one that is still running, for a declined one, and for a damaged record."""
    try:
        past = {key: record[key] for key in ("name", "port", "begun")}
        past["outcome"] = record.get("outcome", PrintState.FAILED.value)
        past["seconds"] = record["ended"] - past["begun"] if "ended" in record else None
        goes_on = "outcome" not in record and _is_running(record["pid"])
    except (KeyError, TypeError, OverflowError):
        return None
    return None if goes_on or past["outcome"] in NOT_PRINTED else past | {"filament_m": record.get("filament_m")}


def _is_running(pid: int) -> bool:
    """Whether there is a process of this number; on Windows, where asking would end it, there is none."""
    if os.name != "posix":
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _records() -> Iterator[dict[str, Any]]:
    """The records of the file; lines that are damaged are left out."""
    try:
        lines = _path().read_text("utf-8", "replace").splitlines()
    except (OSError, OutputError):
        return
    for line in lines:
        with suppress(ValueError):
            record = json.loads(line)
            if isinstance(record, dict) and isinstance(record.get("key"), str):
                yield record


def _append(record: dict[str, Any]) -> None:
    with suppress(OSError, OutputError):
        path = _path()
        if path.exists() and path.stat().st_size > MOST_BYTES:
            newest = [json.dumps(kept) for kept in _records()][-2 * MOST_PRINTS :]
            write_bytes(path, "".join(f"{line}\n" for line in newest).encode(), private=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        with os.fdopen(descriptor, "ab") as file:
            file.write(f"{json.dumps(record)}\n".encode())


def _path() -> Path:
    return state_folder() / FILE

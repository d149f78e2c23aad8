"""Print history: which prints have ended, how, and how long they took: a file for each print in the state folder.

A print's file is locked as long as the print runs, and has two lines: one written when it begins, one when it ends. A print
without the second line was killed.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep, time
from typing import Any, BinaryIO

from machine.dryrun.dryrun import Timeline
from machine.link.journal import is_being_printed
from machine.link.print_state import PrintState
from machine.pipeline.programs import LoadedProgram
from machine.printing.job import End
from profiles.errors import OutputError
from profiles.files import dated_name, keep_newest, lock
from profiles.folders import state_folder

FOLDER = "prints"
MOST_PRINTS = 100  # files that are kept, the newest ones
LOCKED_WITHIN_S = 1.0
Reach = Callable[[int, int], None]  # called with the first and last printed line of the program
NOT_PRINTED = (PrintState.DECLINED, PrintState.REFUSED)


def recorded(loaded: LoadedProgram, port: str, act: Callable[[Reach], End]) -> End:
    """Print a program, as `act` does, and keep how that ended, with the filament that it took. Raises what `act` raises; a print
    does not fail because its record cannot be written."""
    end, file, lines = End(PrintState.FAILED), None, (1, 0)

    def reach(first: int, last: int) -> None:
        nonlocal lines
        lines = first, last

    with suppress(OSError, OutputError):
        file = _new_file()
        _write(file, {"name": loaded.name, "port": port, "begun": time()})
    try:
        end = act(reach)
        return end
    finally:
        first, last = lines if end.state is not PrintState.DONE else (lines[0], len(loaded.program.lines))
        filament_mm = Timeline(loaded.program.run).filament_mm
        filament_m = None if end.state is PrintState.LEFT else (filament_mm(last) - filament_mm(first - 1)) / 1000.0
        if file is not None:
            with suppress(OSError), file:
                _write(file, {"outcome": end.state.value, "ended": time(), "filament_m": filament_m})
            if end.state in NOT_PRINTED:
                with suppress(OSError):
                    Path(file.name).unlink()


def past_prints() -> list[dict[str, Any]]:
    """Prints that are over, the newest first: `name`, `port`, `outcome` (a value of PrintState), `begun` (seconds since 1970),
    `seconds` and `filament_m` (None where the print was killed or left)."""
    with suppress(OSError, OutputError):
        return [past for file in sorted(_files(), reverse=True) if (past := _past(file)) is not None]
    return []


def _past(file: Path) -> dict[str, Any] | None:
    """A print as pages get it; None for one that still runs, for a declined one, and for a damaged file."""
    try:
        is_running, record = is_being_printed(file), dict[str, Any]()
        for line in file.read_text("utf-8").splitlines():
            record |= json.loads(line)
        past = {key: record[key] for key in ("name", "port", "begun")}
        past["outcome"] = record.get("outcome", PrintState.FAILED.value)
        past["seconds"] = record["ended"] - past["begun"] if "ended" in record else None
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return None
    return None if is_running or past["outcome"] in NOT_PRINTED else past | {"filament_m": record.get("filament_m")}


def _files() -> list[Path]:
    return list((state_folder() / FOLDER).glob("*.json"))


def _new_file() -> BinaryIO:
    """A further print's file, locked until it is closed. Raises OSError and OutputError."""
    folder = state_folder() / FOLDER
    folder.mkdir(0o700, exist_ok=True)
    keep_newest(_files(), MOST_PRINTS - 1, lambda file: file.name, is_being_printed)
    file = (folder / f"{dated_name()}.json").open("xb")
    until_s = monotonic() + LOCKED_WITHIN_S
    while not lock(file.fileno()):  # another process is reading it
        if monotonic() > until_s:
            file.close()
            with suppress(OSError):
                Path(file.name).unlink()
            raise OutputError(f"{file.name} cannot be locked")
        sleep(0.01)
    return file


def _write(file: BinaryIO, record: dict[str, Any]) -> None:
    file.write(f"{json.dumps(record)}\n".encode())
    file.flush()

"""Last printer: the port that was printed at last, with its rate, kept for the next start, so that nobody chooses it again."""

import json
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from machine.pipeline.output import write_bytes
from machine.pipeline.requests import PrintRequest
from profiles.errors import OutputError
from profiles.folders import state_folder

FILE = "last-printer.json"


def last_printer() -> PrintRequest | None:
    """The one that was kept; None where none was, or what is there says nothing."""
    try:
        port, baud, speed = (json.loads(_path().read_bytes())[key] for key in ("port", "baud", "sim_speed"))
        return PrintRequest(str(port), int(baud), float(speed))
    except (OSError, ValueError, KeyError, TypeError, OutputError):
        return None


def keep_printer(printing: PrintRequest) -> None:
    """Where it cannot be written it is forgotten: a print does not fail for that."""
    with suppress(OSError, OutputError):
        write_bytes(
            _path(), json.dumps({key: asdict(printing)[key] for key in ("port", "baud", "sim_speed")}).encode(), private=True
        )


def _path() -> Path:
    return state_folder() / FILE

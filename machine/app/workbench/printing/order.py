"""Order: what is to be printed where, and the state of a print as its process tells it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from machine.app.requests import PrintRequest
from machine.dryrun.findings import KnownFindings
from machine.network.address import is_server_address
from profiles.profile import Profile

# checking: nothing but a question has gone to the printer; ready: waits for a person's word; uploading: a print server gets the
# file; leaving: the heaters go off.
Phase = Literal["checking", "ready", "uploading", "printing", "leaving", "over"]
State = dict[str, Any]  # of a print, as JSON: order, phase and all that process.py tells


@dataclass(frozen=True, eq=False)
class PrintOrder:
    """gcode: a file as `export` writes it of the same parts; force: go on as `print --force` does; key: of the slices; starts:
    False where a print server is only to keep the file, as of `send`; known: what has been found of a dry run already."""

    name: str
    gcode: Path
    profile: Profile
    printing: PrintRequest
    force: bool = False
    key: str = ""
    starts: bool = True
    known: KnownFindings | None = None


@dataclass(frozen=True, eq=False)
class ResumeOrder:
    """The rest of a print that was cut off. journal: of it; machine: the profile that tells how the machine is homed with a print
    on it, a name or a file; "": the journal's own."""

    journal: Path
    printing: PrintRequest
    machine: str = ""


@dataclass(frozen=True, eq=False)
class FollowOrder:
    """What a print server, the port, prints already."""

    printing: PrintRequest


Order = PrintOrder | ResumeOrder | FollowOrder


def first_state(order: Order) -> State:
    """What is known of a print before its process has said anything."""
    printing = order.printing
    return {
        "phase": "checking",
        **_known(order),
        "starts": not isinstance(order, PrintOrder) or order.starts,
        "port": printing.port,
        "baud": printing.baud,
        "sim_speed": printing.sim_speed,
        "server": is_server_address(printing.port),
        "checks": (),
        "figures": None,
        "question": "",
        "upload": None,
        "progress": None,
        "words": (),
        "said": (),
        "log": "",
        "journal": "",
        "end": "",
        "sentence": "",
        "forcible": False,
        "stop_given": False,
    }


def _known(order: Order) -> State:
    """resumes: the journal of the print whose rest it is; key: of the slices."""
    if isinstance(order, FollowOrder):
        return {"resumes": "", "name": "what it prints", "machine": "", "force": False, "key": ""}
    if isinstance(order, ResumeOrder):
        return {"resumes": str(order.journal), "name": order.journal.stem, "machine": "", "force": False, "key": ""}
    return {"resumes": "", "name": order.name, "machine": order.profile.machine.name, "force": order.force, "key": order.key}

"""Order: what is to be printed where, and the state of a print as its process tells it."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Literal

from machine.dryrun.findings import KnownFindings
from machine.pipeline.requests import PrintRequest
from machine.printing.servers.address import is_server_address
from profiles.profile import Profile

# checking: nothing but a question has gone to the printer; ready: waits for a person's word; uploading: a print server gets the
# file; hand: nothing is printed, a person heats and moves the machine; leaving: the heaters go off.
Phase = Literal["checking", "ready", "uploading", "printing", "hand", "leaving", "over"]
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


@dataclass(frozen=True, eq=False)
class HandOrder:
    """Nothing is printed: a person heats and moves the machine."""

    profile: Profile
    printing: PrintRequest


class HandDoes(StrEnum):
    """What a person may do by hand."""

    HEAT = "heat"
    COOL = "cool"
    HOME = "home"
    JOG = "jog"
    LET_GO = "let_go"


@dataclass(frozen=True)
class HandCommand:
    """axis, by_mm: of a jog; keep_heat: of letting go, the heaters stay as they are."""

    does: HandDoes
    axis: str = ""
    by_mm: float = 0.0
    keep_heat: bool = False


Order = PrintOrder | ResumeOrder | FollowOrder | HandOrder


def first_state(order: Order) -> State:
    """What is known of a print before its process has said anything. resumes: the journal of the print whose rest it is; key: of
    the slices."""
    printing, slices = order.printing, order if isinstance(order, PrintOrder) else None
    journal = order.journal if isinstance(order, ResumeOrder) else None
    return {
        "phase": "checking",
        "name": slices.name
        if slices
        else journal.stem
        if journal
        else "by hand"
        if isinstance(order, HandOrder)
        else "what it prints",
        "machine": slices.profile.machine.name if slices else "",
        "resumes": str(journal or ""),
        "key": slices.key if slices else "",
        "force": bool(slices and slices.force),
        "starts": slices is None or slices.starts,
        "port": printing.port,
        "baud": printing.baud,
        "sim_speed": printing.sim_speed,
        "server": is_server_address(printing.port),
        **dict.fromkeys(("question", "log", "journal", "webcam", "end", "sentence"), ""),
        **dict.fromkeys(("checks", "words", "said"), ()),
        **dict.fromkeys(("figures", "upload", "progress")),
        **dict.fromkeys(("forcible", "stop_given"), False),
    }

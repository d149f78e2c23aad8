"""Order: what is to be printed where, and the state of a print as its process tells it."""

from dataclasses import dataclass
from typing import Any, Literal

from machine.app.requests import PrintRequest
from profiles.profile import Profile

# checking: nothing but a question has gone to the printer; ready: waits for a person's word; leaving: the heaters go off.
Phase = Literal["checking", "ready", "printing", "leaving", "over"]
State = dict[str, Any]  # of a print, as JSON: order, phase and all that process.py tells


@dataclass(frozen=True, eq=False)
class PrintOrder:
    """gcode: the file that `export` writes of the same parts; force: go on as `print --force` does; key: of the slices."""

    name: str
    gcode: bytes
    profile: Profile
    printing: PrintRequest
    force: bool = False
    key: str = ""


def first_state(order: PrintOrder) -> State:
    """What is known of a print before its process has said anything."""
    printing = order.printing
    return {
        "phase": "checking",
        "key": order.key,
        "name": order.name,
        "port": printing.port,
        "baud": printing.baud,
        "sim_speed": printing.sim_speed,
        "machine": order.profile.machine.name,
        "force": order.force,
        "checks": (),
        "figures": None,
        "progress": None,
        "words": (),
        "said": (),
        "log": "",
        "journal": "",
        "end": "",
        "sentence": "",
        "forcible": False,
    }

"""Limits of paired devices: they may not name files of this computer, or machines to connect to.

They choose among what was found here and what this computer's own page has used; everything else that a page does is allowed.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from machine.pipeline.requests import SIMULATED
from mdp.ranking.ranker import CLASSIC, LEARNED
from profiles.errors import JournalError, MeshError, PlanError, PrinterError, ProfileError
from profiles.places import PARENT, kind_in, known, parse

DEVICE = "tiltprint.device"  # key of a request's scope: the number of its device
NAMING_FILES = (".gltf", ".dae")  # models whose content may be in other files
ON_THIS_COMPUTER = "do that on the page of the computer itself"


def check_bench_command(asked: Mapping[str, Any]) -> None:
    """Raise PlanError for a command of a bench that names a file."""
    if asked.get("do") == "search" and str(asked.get("ranker") or "").strip() not in ("", CLASSIC, LEARNED):
        raise PlanError(f"a paired device chooses {CLASSIC} or {LEARNED} as ranker, no file: {ON_THIS_COMPUTER}")


def check_print_command(asked: Mapping[str, Any], ports: Collection[str], journals: Collection[str]) -> None:
    """Raise PrinterError for a command of prints that names a port other than these, JournalError or ProfileError for one that
    names a file. ports, journals: found here, or used by this computer's page."""
    port, journal, machine = (str(asked.get(key) or "").strip() for key in ("port", "journal", "machine"))
    if port and port not in (SIMULATED, *ports):
        raise PrinterError(f"a paired device chooses among the ports that were found here or used before: {ON_THIS_COMPUTER}")
    if journal and journal not in journals:
        raise JournalError(f"a paired device chooses among the prints that were found here: {ON_THIS_COMPUTER}")
    if machine and machine not in known("machine"):
        raise ProfileError(f"a paired device names a machine that is known here, no file: {ON_THIS_COMPUTER}")


def check_model_name(name: str) -> None:
    """Raise MeshError for a model that may include other files, which would be read from this computer."""
    if Path(name).suffix.lower() in NAMING_FILES:
        kinds = " and ".join(NAMING_FILES)
        raise MeshError(f"{name}: {kinds} may name files of the computer, so a paired device sends none: a .glb is taken")


def check_plan(path: Path) -> None:
    """Raise PlanError for a plan that includes a mesh file, which would be read from this computer."""
    try:
        tables = parse(path).values()
    except ProfileError:
        return  # not a plan, which its reader reports
    rows = [row for table in tables if isinstance(table, list) for row in table]
    if any(isinstance(row, Mapping) and "mesh" in row for row in rows):
        raise PlanError(f"{path.name}: the plan of a paired device names no mesh file: {ON_THIS_COMPUTER}")


def check_profile(path: Path) -> None:
    """Raise ProfileError for a profile that inherits from a file of this computer."""
    try:
        parent, kind = parse(path).get(PARENT), kind_in(path)
    except ProfileError:
        return  # not a profile, which its reader reports
    if parent is not None and parent not in known(kind):
        raise ProfileError(f"{path.name}: the profile of a paired device inherits one that is known here by its name, no file")

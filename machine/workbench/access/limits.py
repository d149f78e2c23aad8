"""Limits: what a paired device may not ask for: whatever names a file of this computer, or a machine that it is to speak to.

It chooses among what was found here and what this computer's own page has used; all else that a page does it may do.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from machine.pipeline.requests import SIMULATED
from mdp.ranking.ranker import CLASSIC, LEARNED
from profiles.errors import JournalError, MeshError, PlanError, PrinterError, ProfileError
from profiles.places import PARENT, kind_in, known, parse

DEVICE = "tiltprint.device"  # in the scope of a request: the number of the device that it is of
NAMING_FILES = (".gltf", ".dae")  # models that may have their content in other files
ON_THIS_COMPUTER = "do that on the page of the computer itself"


def check_bench_command(asked: Mapping[str, Any]) -> None:
    """Raises PlanError for a command of a bench that names a file."""
    if asked.get("do") == "search" and str(asked.get("ranker") or "").strip() not in ("", CLASSIC, LEARNED):
        raise PlanError(f"a paired device chooses {CLASSIC} or {LEARNED} as ranker, no file: {ON_THIS_COMPUTER}")


def check_print_command(asked: Mapping[str, Any], ports: Collection[str], journals: Collection[str]) -> None:
    """Raises PrinterError for a command of prints that names a port other than these, JournalError or ProfileError for one that
    names a file. ports, journals: that were found, or that this computer's page has used."""
    port, journal, machine = (str(asked.get(key) or "").strip() for key in ("port", "journal", "machine"))
    if port and port not in (SIMULATED, *ports):
        raise PrinterError(f"a paired device chooses among the ports that were found here or used before: {ON_THIS_COMPUTER}")
    if journal and journal not in journals:
        raise JournalError(f"a paired device chooses among the prints that were found here: {ON_THIS_COMPUTER}")
    if machine and machine not in known("machine"):
        raise ProfileError(f"a paired device names a machine that is known here, no file: {ON_THIS_COMPUTER}")


def check_model_name(name: str) -> None:
    """Raises MeshError for a model that may name other files, which would be read here."""
    if Path(name).suffix.lower() in NAMING_FILES:
        kinds = " and ".join(NAMING_FILES)
        raise MeshError(f"{name}: {kinds} may name files of the computer, so a paired device sends none: a .glb is taken")


def check_plan(path: Path) -> None:
    """Raises PlanError for a plan that names a mesh file, which would be read from this computer."""
    try:
        tables = parse(path).values()
    except ProfileError:
        return  # no plan: who reads it says what it is
    rows = [row for table in tables if isinstance(table, list) for row in table]
    if any(isinstance(row, Mapping) and "mesh" in row for row in rows):
        raise PlanError(f"{path.name}: the plan of a paired device names no mesh file: {ON_THIS_COMPUTER}")


def check_profile(path: Path) -> None:
    """Raises ProfileError for a profile that inherits from a file of this computer."""
    try:
        parent, kind = parse(path).get(PARENT), kind_in(path)
    except ProfileError:
        return  # no profile: who reads it says what it is
    if parent is not None and parent not in known(kind):
        raise ProfileError(f"{path.name}: the profile of a paired device inherits one that is known here by its name, no file")

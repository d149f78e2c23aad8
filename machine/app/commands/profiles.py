"""The profiles commands: list, show, check."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from machine.app.terminal.plain import plain_line, plain_lines
from machine.app.terminal.progress import say
from profiles.check import check_file
from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.machine import Machine
from profiles.places import own, own_folder
from profiles.profile import KINDS, kind_of, load, load_one, rows, shipped


def list_profiles() -> int:
    """Print the shipped profiles of every kind and the user's own."""
    for kind in KINDS:
        sys.stdout.write(f"{kind}: {', '.join(shipped(kind))}\n")
        if own(kind):
            sys.stdout.write(plain_lines(f"{kind}, yours ({own_folder(kind)}): {', '.join(own(kind))}") + "\n")
    return 0


def show(name: str, as_json: bool, settings: Sequence[str]) -> int:
    """Print the resolved values of one profile, as JSON or as lines with what each key means."""
    sections = load_one(name, settings)
    if as_json:
        sys.stdout.write(
            json.dumps({section: model.model_dump(mode="json") for section, model in sections.items()}, indent=2) + "\n"
        )
        return 0
    for section, model in sections.items():
        for key, value, meaning in rows(section, model):
            comment = "; ".join(each for each in (meaning, _origin(model, key)) if each)
            sys.stdout.write(plain_lines(f"{key} = {json.dumps(value)}" + (f"  # {comment}" if comment else "")) + "\n")
    return 0


def _origin(model: Frozen, key: str) -> str:
    """Where a machine's number comes from: its source, or that no source gives it."""
    if not isinstance(model, Machine):
        return ""
    steps = key.split(".")
    places = [".".join(steps[:k]) for k in range(len(steps), 1, -1)]
    if any(place in model.uncalibrated for place in places):
        return "UNCALIBRATED"
    return next((f"from: {model.sources[place]}" for place in places if place in model.sources), "")


def check(file: Path) -> int:
    """Print every problem of a profile file; 1 when there are any."""
    problems = check_file(file)
    if not problems and kind_of(str(file)) == "machine":
        problems = _block_problems(load_one(str(file))["machine"])
    for problem in problems:
        say(f"tiltprint: {problem if str(file) in problem else f'{file}: {problem}'}")
    if not problems:
        sys.stdout.write(plain_line(f"{file}: no problem found") + "\n")
    return 1 if problems else 0


def _block_problems(machine: Frozen) -> list[str]:
    """What cannot be filled in of the machine's G-code blocks, each block by itself."""
    from machine.gcode.writer import BLOCKS, write_gcode
    from machine.planning.moves import MachineProgram

    problems: list[str] = []
    if not isinstance(machine, Machine):
        return problems
    for name in BLOCKS:
        empty = dict.fromkeys(BLOCKS, "")
        blocks = machine.gcode.model_copy(update=empty | {name: getattr(machine.gcode, name)})
        profile = load().model_copy(update={"machine": machine.model_copy(update={"gcode": blocks})})
        try:
            write_gcode(MachineProgram("check", ()), profile)
        except ProfileError as error:
            problems.append(str(error))
    return problems

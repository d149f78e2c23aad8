"""The profiles commands list, show, save and check."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from machine.notices import plain_line, plain_lines, say
from profiles.frozen import Frozen
from profiles.machine import Machine
from profiles.places import own, own_folder
from profiles.profile import KINDS, check_file, kind_of, load, load_one, rows, shipped


def list_profiles() -> int:
    """Print the names of all shipped profiles and of the user's own."""
    for kind in KINDS:
        sys.stdout.write(f"{kind}: {', '.join(shipped(kind))}\n")
        if own(kind):
            sys.stdout.write(plain_lines(f"{kind}, yours ({own_folder(kind)}): {', '.join(own(kind))}") + "\n")
    return 0


def show(name: str, as_json: bool, settings: Sequence[str]) -> int:
    """Print the resolved values of one profile, as JSON or as lines with the meaning of each key."""
    sections = load_one(name, settings)
    if as_json:
        sys.stdout.write(
            json.dumps({section: model.model_dump(mode="json") for section, model in sections.items()}, indent=2) + "\n"
        )
        return 0
    for section, model in sections.items():
        for key, value, meaning in rows(section, model):
            comment = "; ".join(phrase for phrase in (meaning, _origin(model, key)) if phrase)
            sys.stdout.write(plain_lines(f"{key} = {json.dumps(value)}" + (f"  # {comment}" if comment else "")) + "\n")
    return 0


def _origin(model: Frozen, key: str) -> str:
    """Source of a machine's value, or "UNCALIBRATED"."""
    if not isinstance(model, Machine):
        return ""
    steps = key.split(".")
    paths = [".".join(steps[:k]) for k in range(len(steps), 1, -1)]
    if any(path in model.uncalibrated for path in paths):
        return "UNCALIBRATED"
    return next((f"from: {model.sources[path]}" for path in paths if path in model.sources), "")


def save(name: str, settings: Sequence[str], out: Path, replace: bool) -> int:
    """Write a profile with changed settings as a profile file. replace: overwrite a file, which is kept beside it."""
    from machine.pipeline.output import check_writable, refuse_to_overwrite, write_own
    from machine.pipeline.profile_file import profile_text

    check_writable(out)
    refuse_to_overwrite(out, replace)
    kind = kind_of(name)
    write_own(out, profile_text(kind, name, settings), replace)
    say(f"saved: {out}; use it as --{kind} {out}")
    return 0


def check(file: Path) -> int:
    """Print every problem of a profile file; returns 1 if there are any."""
    problems = check_file(file)
    if not problems and kind_of(str(file)) == "machine":
        from machine.gcode.blocks import block_problems

        problems = block_problems(load().model_copy(update=load_one(str(file))))
    for problem in problems:
        say(f"tiltprint: {problem if str(file) in problem else f'{file}: {problem}'}")
    if not problems:
        sys.stdout.write(plain_line(f"{file}: no problem found") + "\n")
    return 1 if problems else 0

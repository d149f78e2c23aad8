"""The profiles commands: list, show, check."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from profiles.profile import KINDS, check_file, load_one, rows, shipped


def list_profiles() -> int:
    """Print the shipped profiles of every kind."""
    for kind in KINDS:
        sys.stdout.write(f"{kind}: {', '.join(shipped(kind))}\n")
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
            sys.stdout.write(f"{key} = {json.dumps(value)}" + (f"  # {meaning}\n" if meaning else "\n"))
    return 0


def check(file: Path) -> int:
    """Print every problem of a profile file; 1 when there are any."""
    problems = check_file(file)
    for problem in problems:
        sys.stderr.write(f"tiltprint: {file}: {problem}\n")
    if not problems:
        sys.stdout.write(f"{file}: no problem found\n")
    return 1 if problems else 0

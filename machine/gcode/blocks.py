"""Blocks: what a G-code block of a machine may name, and why it cannot be filled in, before there is a program."""

from machine.firmware import dialect_of
from machine.gcode.placeholders import fill_block, placeholders, resume_placeholders
from mdp.pose import level
from profiles.errors import ProfileError
from profiles.machine import Blocks
from profiles.profile import Profile

RESUME = "resume"


def placeholder_names(profile: Profile, block: str) -> list[str]:
    """The placeholders of a block, in the order of docs/profiles.md."""
    return list(_values(profile, block))


def block_problems(profile: Profile, *blocks: str) -> list[str]:
    """What cannot be filled in of blocks, of all where none is named; each by itself."""
    problems, machine = [], profile.machine
    for block in blocks or tuple(Blocks.model_fields):
        try:
            text, longest = getattr(machine.gcode, block), dialect_of(machine).longest_line
            fill_block(text, f"machine.gcode.{block}", _values(profile, block), longest)
        except ProfileError as error:
            problems.append(str(error))
    return problems


def _values(profile: Profile, block: str) -> dict[str, object]:
    if block == RESUME:
        return resume_placeholders(profile.machine, (0.0, 0.0, 0.0), level(profile.machine), 0.0)
    return placeholders("check", profile, [], 0.0, 0.0)

"""Blocks: what a G-code block of a machine may name, and why it cannot be written, before there is a program."""

from collections.abc import Iterator, Mapping, Sequence

from machine.firmware import dialect_of
from machine.firmware.dialect import Dialect
from machine.gcode.commands import COMMANDS, Heat, command_named, heat_in, homes
from machine.gcode.line_text import read_line
from machine.gcode.placeholders import fill_block, placeholders, resume_placeholders
from machine.gcode.words import FLAG, MACRO
from mdp.pose import level
from profiles.errors import MoveError, ProfileError
from profiles.machine import Blocks, Machine
from profiles.places import shipped_of_dialect
from profiles.profile import Profile

RESUME, START = "resume", "start"
MOST_QUOTED = 3
OTHER_WORD = {"S": "P", "P": "S"}  # what a temperature stands behind in the other kind of firmware
WITH_E = {"G76", "M66", "M67", "M68"}  # the commands of CNC programs that use an E
EXPRESSION = frozenset("#[<%")  # of CNC programs, which are not read here


def placeholder_names(profile: Profile, block: str) -> list[str]:
    """The placeholders of a block, in the order of docs/profiles.md."""
    return list(_values(profile, block))


def block_problems(profile: Profile, *blocks: str) -> list[str]:
    """What cannot be filled in of blocks, of all where none is named, each by itself; and what the firmware refuses of them."""
    machine, dialect = profile.machine, dialect_of(profile.machine)
    problems, refused = [], {}
    for block in blocks or tuple(Blocks.model_fields):
        try:
            lines = fill_block(getattr(machine.gcode, block), f"machine.gcode.{block}", _values(profile, block), dialect)
            refused[block] = list(refused_lines(lines, dialect))
        except ProfileError as error:
            problems.append(str(error))
    return [*problems, *_foreign(machine, {block: lines for block, lines in refused.items() if lines})]


def check_blocks(profile: Profile) -> None:
    """Raises ProfileError where a block cannot be filled in, or is written for another firmware."""
    problems = block_problems(profile)
    if problems:
        raise ProfileError("; ".join(problems))


def _foreign(machine: Machine, refused: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """What a person should do about lines of blocks that the firmware refuses."""
    if not refused:
        return
    lines = list(dict.fromkeys(line for block in refused.values() for line in block))
    shown = ", ".join(repr(line) for line in lines[:MOST_QUOTED]) + (", ..." if len(lines) > MOST_QUOTED else "")
    blocks = " and ".join(f"machine.gcode.{block}" for block in refused)
    known = ", ".join(shipped_of_dialect(machine.dialect))
    inherit = f"use or inherit a machine of that dialect ({known}), or " if known else ""
    yield (
        f"machine.dialect is {machine.dialect}, but {blocks} {'are' if len(refused) > 1 else 'is'} written for another firmware: "
        f"{dialect_of(machine).firmware} does not take {shown}; {inherit}write {blocks} in its words"
    )


def _values(profile: Profile, block: str) -> dict[str, object]:
    if block == RESUME:
        return resume_placeholders(profile.machine, (0.0, 0.0, 0.0), level(profile.machine), 0.0)
    return placeholders("check", profile, [], 0.0, 0.0)


def filled_start(profile: Profile) -> list[str]:
    """The lines of the start block with its placeholders filled in, comments left out. Raises ProfileError."""
    machine = profile.machine
    lines = fill_block(machine.gcode.start, START, _values(profile, START), dialect_of(machine))
    return [command for line in lines if (command := read_line(line).command)]


def cold_block(lines: Sequence[str], dialect: Dialect) -> tuple[list[str], list[str]]:
    """The filled-in lines of a block that homes, without what heats or waits for heat; and those that are left out because they
    run a macro, a file or a cycle of the machine's own, or are not known.

    Raises MoveError where a line that may heat is one that homes, or stands before it: without it the machine may not be homed
    as it must be. A block without homing is one as a whole, but for a firmware that is homed by hand.
    """
    heats = [heat_in(line, dialect) for line in lines]
    homing = [index for index, line in enumerate(lines) if homes(line, dialect)]
    last = homing[-1] if homing else -1 if dialect.homed_before else len(lines)
    for index, (line, heat) in enumerate(zip(lines, heats, strict=True)):
        if (heat is Heat.UNSURE and index <= last) or (heat is Heat.HEATS and index in homing):
            raise MoveError(
                f"machine.gcode.start: {line!r} may heat ({heat.value}), and the machine is not homed before it: a machine that "
                "is to stay cold cannot be homed by this block"
            )
    kept, unsure = ([line for line, own in zip(lines, heats, strict=True) if own is heat] for heat in (Heat.COLD, Heat.UNSURE))
    return kept, unsure


def refused_lines(lines: Sequence[str], dialect: Dialect) -> Iterator[str]:
    """The filled-in lines of a block that are not in the firmware's words."""
    for line in lines:
        text = read_line(line).command.upper()
        if text and text.split()[0] not in dialect.statements and not _is_known(text, dialect):
            yield line


def _is_known(text: str, dialect: Dialect) -> bool:
    if MACRO.fullmatch(text):
        return dialect.macros
    if not dialect.bare_words and (text[0] in "/O" or EXPRESSION & set(text)):
        return True
    words = FLAG.findall(text)
    named = [f"{letter}{float(number):g}" for letter, number in words if letter in "GM" and number]
    letters = {letter for letter, _ in words}
    heats = named and command_named(named[0], COMMANDS).heats not in ("", "any")
    if dialect.lacks & {*named} or (heats and letters == {"M", OTHER_WORD[dialect.value_word]}):
        return False
    return dialect.bare_words or (all(number for _, number in words) and ("E" not in letters or bool(WITH_E & {*named})))

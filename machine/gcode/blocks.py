"""Blocks: a machine's G-code blocks: placeholders, values and checks."""

import re
from collections.abc import Iterator, Mapping, Sequence

from machine.firmware import dialect_of
from machine.firmware.dialect import Dialect
from machine.firmware.firmware import FRAME_CHARACTERS
from machine.firmware.klipper import stepper_name
from machine.gcode.commands import COMMANDS, Heat, command_named, heat_in, homes, stands_still
from machine.gcode.line_text import plain_line, read_line
from machine.gcode.words import FLAG, MACRO
from machine.planning.moves import BeginPart
from machine.quantities import duration, filament_g
from mdp.mesh import Floats
from mdp.pose import Pose, level
from profiles.errors import GcodeError, MoveError, ProfileError
from profiles.machine import Blocks, Machine
from profiles.messages import key_name
from profiles.places import shipped_of_dialect
from profiles.profile import Profile

RESUME, BEFORE_LAYER = "resume", "before_layer"
MOST_QUOTED = 3
OTHER_WORD = {"S": "P", "P": "S"}  # the word of a temperature in the other kind of firmware
WITH_E = {"G76", "M66", "M67", "M68"}  # commands of CNC programs with an E word
EXPRESSION = frozenset("#[<%")  # characters of CNC programs, which are not parsed here
PLACEHOLDER = re.compile(r"\{(\w+)\}")


def block_problems(profile: Profile, *blocks: str) -> list[str]:
    """Problems of blocks, by default of all: placeholders that cannot be filled in, and lines that the firmware refuses."""
    machine, dialect = profile.machine, dialect_of(profile.machine)
    problems, refused = list[str](), dict[str, list[str]]()
    for block in blocks or tuple(Blocks.model_fields):
        try:
            lines = fill_block(
                getattr(machine.gcode, block), f"{key_name(f'machine.gcode.{block}')}", block_values(profile, block), dialect
            )
            refused[block] = list(refused_lines(lines, dialect))
            problems += _moving(lines, dialect) if block == BEFORE_LAYER else ()
        except ProfileError as error:
            problems.append(f"{error}")
    return [*problems, *_foreign(machine, {block: lines for block, lines in refused.items() if lines})]


def check_blocks(profile: Profile) -> None:
    """Raise ProfileError if a block cannot be filled in, or is written for another firmware."""
    problems = block_problems(profile)
    if problems:
        raise ProfileError("; ".join(problems))


def _moving(lines: Sequence[str], dialect: Dialect) -> Iterator[str]:
    """A problem for each line of the block before layers that cannot be run above a print."""
    for line in lines:
        if not stands_still(line, dialect):
            yield (
                f"{key_name(f'machine.gcode.{BEFORE_LAYER}')}: {line!r} may move an axis or change a mode: over the "
                "print only commands are "
                "allowed that are known to do neither, macros are not"
            )


def _foreign(machine: Machine, refused: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Advice about lines of blocks that the firmware refuses."""
    if not refused:
        return
    lines = list(dict.fromkeys(line for block in refused.values() for line in block))
    shown = ", ".join(repr(line) for line in lines[:MOST_QUOTED]) + (", ..." if len(lines) > MOST_QUOTED else "")
    blocks = " and ".join(f"{key_name(f'machine.gcode.{block}')}" for block in refused)
    known = ", ".join(shipped_of_dialect(machine.dialect))
    inherit = f"use or inherit a machine of that dialect ({known}), or " if known else ""
    yield (
        f"{key_name('machine.dialect')} is {machine.dialect}, but {blocks} {'are' if len(refused) > 1 else 'is'} "
        "written for another firmware: "
        f"{dialect_of(machine).firmware} does not take {shown}; {inherit}write {blocks} in its words"
    )


def block_values(profile: Profile, block: str) -> dict[str, object]:
    """The placeholders of a block, in the order of docs/machines.md, each with an example value."""
    if block == RESUME:
        return resume_placeholders(profile.machine, (0.0, 0.0, 0.0), level(profile.machine), 0.0)
    values = placeholders("check", profile, [], 0.0, 0.0)
    return values | {"layer_num": 0, "layer_z": 0.0, "max_layer_z": 0.0} if block == BEFORE_LAYER else values


def filled_start(profile: Profile) -> list[str]:
    """The lines of the start block, filled in and without comments. Raises ProfileError."""
    machine = profile.machine
    lines = fill_block(machine.gcode.start, "start", block_values(profile, "start"), dialect_of(machine))
    return [command for line in lines if (command := read_line(line).command)]


def cold_block(lines: Sequence[str], dialect: Dialect) -> tuple[list[str], list[str]]:
    """The filled-in lines of a homing block without heating, and those omitted because they run a macro, a file or a machine
    cycle, or are unknown.

    Raises MoveError if a line that may heat also homes, or comes before homing: without it the machine may not be homed properly.
    A block without homing counts as a whole, unless the firmware is homed by hand.
    """
    heats = [heat_in(line, dialect) for line in lines]
    homing = [index for index, line in enumerate(lines) if homes(line, dialect)]
    last = homing[-1] if homing else -1 if dialect.homed_before else len(lines)
    for index, (line, heat) in enumerate(zip(lines, heats, strict=True)):
        if (heat is Heat.UNSURE and index <= last) or (heat is Heat.HEATS and index in homing):
            raise MoveError(
                f"{key_name('machine.gcode.start')}: {line!r} may heat ({heat.value}), and the machine is not homed "
                "before it: a machine that "
                "is to stay cold cannot be homed by this block"
            )
    kept, unsure = ([line for line, own in zip(lines, heats, strict=True) if own is heat] for heat in (Heat.COLD, Heat.UNSURE))
    return kept, unsure


def refused_lines(lines: Sequence[str], dialect: Dialect) -> Iterator[str]:
    """The filled-in lines of a block that the firmware does not understand."""
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


def placeholders(name: str, profile: Profile, parts: list[BeginPart], seconds: float, filament_mm: float) -> dict[str, object]:
    """The placeholders of the blocks; the part's values change from part to part."""
    machine, material, process = profile.machine, profile.material, profile.process
    first = parts[0] if parts else None
    pose = first.pose if first else level(machine)
    return {
        **_axes(machine), "nozzle_c": material.nozzle_c, "first_layer_nozzle_c": material.first_layer_nozzle_c,
        "homing_nozzle_c": material.homing_nozzle_c, "bed_c": material.bed_c, "nozzle_mm": machine.head.nozzle_mm,
        "layer_height_mm": process.layer_height_mm, "parts": len(parts), "layers": sum(part.layers for part in parts),
        "part": first.index if first else 0, "part_layers": first.layers if first else 0,
        "tilt_deg": pose.tilt_deg, "turn_deg": pose.turn_deg, "z_mm": 0.0, "time": duration(seconds), "time_s": round(seconds),
        "filament_mm": round(filament_mm, 2), "filament_g": round(filament_g(filament_mm, material), 2),
        "model": "".join(c if "!" <= c <= "~" and c not in "(){};*" else "_" for c in name),
        "material": material.name, "process": process.name, "machine": machine.name,
    }  # fmt: skip


def resume_placeholders(machine: Machine, tip_mm: Sequence[float] | Floats, pose: Pose, clear_z_mm: float) -> dict[str, object]:
    """The placeholders of the block that resumes a print after a power cut: tip position, pose, safe height."""
    return {
        "x_mm": float(tip_mm[0]), "y_mm": float(tip_mm[1]), "z_mm": float(tip_mm[2]),
        "tilt_deg": pose.tilt_deg, "turn_deg": pose.turn_deg, "clear_z_mm": clear_z_mm, **_axes(machine),
    }  # fmt: skip


def _axes(machine: Machine) -> dict[str, object]:
    """The placeholders of the rotary axes, for all blocks."""
    return {
        "tilt": machine.tilt.letter, "turn": machine.turn.letter,
        "tilt_stepper": stepper_name(machine.tilt), "turn_stepper": stepper_name(machine.turn),
        "tilt_speed": machine.tilt.speed_deg_s, "turn_speed": machine.turn.speed_deg_s,
        "tilt_acceleration": machine.tilt.acceleration_deg_s2, "turn_acceleration": machine.turn.acceleration_deg_s2,
    }  # fmt: skip


def fill_block(block: str, name: str, values: Mapping[str, object], dialect: Dialect) -> list[str]:
    """The block's lines with {placeholders} replaced, without empty lines.

    Lines for a serial firmware lose comments in parentheses, whose words it would execute. Raises ProfileError for an unknown
    placeholder, for a line that firmwares read differently and for a command too long for the firmware.
    """
    lines, longest = [], dialect.longest_line
    for line in block.split("\n"):
        text = PLACEHOLDER.sub(lambda match: _value(match[1], name, values), line).rstrip()
        text = text if dialect.statements else text.strip()  # RepRapFirmware recognises the body of an `if` by its indent
        try:
            command = read_line(text).command
            text = plain_line(text) if dialect.serial else text
        except GcodeError as error:
            raise ProfileError(f"{name}: {error}") from None
        if len(command) + FRAME_CHARACTERS > longest:
            raise ProfileError(
                f"{name}: the line {command[:40]!r}... has {len(command)} characters, "
                f"at most {longest - FRAME_CHARACTERS} are allowed (the firmware's {longest} less line number and checksum)"
            )
        if text:
            lines.append(text)
    return lines


def _value(word: str, name: str, values: Mapping[str, object]) -> str:
    if word not in values:
        raise ProfileError(f"{name}: placeholder {{{word}}} is not known: allowed are {', '.join(sorted(values))}")
    value = values[word]
    if isinstance(value, float):
        return f"{value:.4f}".rstrip("0").rstrip(".") if abs(value) >= 5e-5 else "0"
    return str(value)

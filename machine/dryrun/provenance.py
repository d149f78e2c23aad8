"""Provenance: whether a file of ours was made for this machine: its comments against the profile, its poses against the table."""

import re
from collections.abc import Sequence

import numpy as np

from machine.dryrun.findings import Finding
from machine.gcode.settings import comment, flat
from machine.reader.parsed import MoveKind, ParsedProgram
from profiles.profile import Profile

BEGIN, END = "; tiltprint_config = begin", "; tiltprint_config = end"
CENTRE = ("machine.tilt.point_mm", "machine.turn.point_mm", "machine.tool_mm")
SIGN = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("sign", "axis", "letter", "zero_deg"))
POSE = re.compile(r";POSE:([A-Z])(-?[0-9.]+) ([A-Z])(-?[0-9.]+)")
LEVEL_DEG = 1e-3


def findings(lines: Sequence[str], program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Errors of code centre, sign and pose."""
    return [*_geometry(lines, profile), *_poses(lines, program, profile)]


def has_material(lines: Sequence[str], profile: Profile) -> bool:
    """Whether the file's own configuration has the profile's material."""
    recorded = _configuration(lines)
    material = [(f"material.{key}", value) for key, value in flat(profile.material.model_dump(), "")]
    return bool(recorded) and all(recorded[key][1] == comment(f"{key} = {value}") for key, value in material if key in recorded)


def _geometry(lines: Sequence[str], profile: Profile) -> list[Finding]:
    """Keys of the chain of axes that the file's configuration has otherwise than the profile."""
    recorded = _configuration(lines)
    now = {key: (comment(f"{key} = {value}"), value) for key, value in flat(profile.model_dump(), "")}
    problems = []
    for code, keys, what in (("centre", CENTRE, "rotation centre"), ("sign", SIGN, "sense of the axes")):
        for key in keys:
            line, text = recorded.get(key, (0, ""))
            if line and key in now and text != now[key][0]:
                was = text.partition(" = ")[2]
                message = f"the file was made for another {what}: {key} = {was}, the profile has {now[key][1]}"
                problems.append(Finding("error", code, line, 0, 0, message))
    return problems


def _configuration(lines: Sequence[str]) -> dict[str, tuple[int, str]]:
    """Key -> (line number, the whole comment) of the block at a file's foot; empty without one."""
    recorded: dict[str, tuple[int, str]] = {}
    inside = False
    for number in range(len(lines), 0, -1):
        text = lines[number - 1].rstrip()
        if text == END:
            inside = True
        elif text == BEGIN or (text and not text.startswith(";")):
            break
        elif inside:
            recorded.setdefault(text[2:].partition(" = ")[0], (number, text))
    return recorded


def _poses(lines: Sequence[str], program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Parts of which beads are laid at another pose than their ;POSE: comment tells."""
    letters = (profile.machine.tilt.letter, profile.machine.turn.letter)
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (program.part > 0))
    problems = []
    for number in [k for k, line in enumerate(lines, start=1) if line[:6] == ";POSE:"]:
        comment_pose = POSE.match(lines[number - 1])
        if comment_pose is None or (comment_pose[1], comment_pose[3]) != letters:
            continue
        after = int(np.searchsorted(program.line[rows], number))
        if after == len(rows):
            continue
        row, wanted = int(rows[after]), np.array([float(comment_pose[2]), float(comment_pose[4])])
        at = program.end[row, 3:]
        if np.abs(at - wanted).max() > LEVEL_DEG:
            message = (
                f"the part is printed at {letters[0]}{at[0]:.3f} {letters[1]}{at[1]:.3f}, "
                f"it was made for {letters[0]}{wanted[0]:.3f} {letters[1]}{wanted[1]:.3f}"
            )
            problems.append(
                Finding("error", "pose", int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)
            )
    return problems

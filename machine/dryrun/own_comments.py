"""Own comments: compares the comments of a tiltprint file with its moves and with the profile.

Configuration and poses show whether it was made for this machine, the parts' totals whether it was changed since.
"""

import re
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_row
from machine.gcode.lines import Lines
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, pieces
from machine.gcode.settings import CONFIG_BEGIN, CONFIG_END, PartTotals, comment, flat
from profiles.profile import Profile
from slicer.paths import Kind

CENTRE = ("machine.tilt.point_mm", "machine.turn.point_mm", "machine.tool_mm")
SIGN = tuple(f"machine.{axis}.{key}" for axis in ("tilt", "turn") for key in ("sign", "axis", "letter", "zero_deg"))
POSE = re.compile(r";POSE:([A-Z])(-?[0-9.]+) ([A-Z])(-?[0-9.]+)")
LEVEL_DEG = 1e-3
PLACE_MM = 0.02  # rounded coordinates, arcs read as chords, followed positions converted back to axis positions
FILAMENT_SHARE, FILAMENT_MM = 2e-3, 0.05


def findings(lines: Sequence[str], program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Errors of code centre, sign, pose, contents and missing."""
    return [*_part_totals(program), *_geometry(lines, profile), *_poses(lines, program, profile)]


def has_material(lines: Sequence[str], profile: Profile) -> bool:
    """Whether the file's configuration has the profile's material."""
    recorded = _configuration(lines)
    material = [(f"material.{key}", value) for key, value in flat(profile.material.model_dump(), "")]
    return bool(recorded) and all(recorded[key][1] == comment(f"{key} = {value}") for key, value in material if key in recorded)


def _geometry(lines: Sequence[str], profile: Profile) -> Iterator[Finding]:
    """Errors for keys of the kinematic chain that differ between the file's configuration and the profile."""
    recorded = _configuration(lines)
    now = {key: (comment(f"{key} = {value}"), value) for key, value in flat(profile.model_dump(), "")}
    for code, keys, what in (("centre", CENTRE, "rotation centre"), ("sign", SIGN, "sense of the axes")):
        for key in keys:
            line, text = recorded.get(key, (0, ""))
            if line and key in now and text != now[key][0]:
                was = text.partition(" = ")[2]
                message = f"the file was made for another {what}: {key} = {was}, the profile has {now[key][1]}"
                yield Finding("error", code, line, 0, 0, message)


def _configuration(lines: Sequence[str]) -> dict[str, tuple[int, str]]:
    """Key -> (line number, whole comment) of the block at a file's foot; {} without one."""
    recorded: dict[str, tuple[int, str]] = {}
    inside = False
    for number in range(len(lines), 0, -1):
        text = lines[number - 1].rstrip()
        if text == CONFIG_END:
            inside = True
        elif text == CONFIG_BEGIN or (text and not text.startswith(";")):
            break
        elif inside:
            recorded.setdefault(text[2:].partition(" = ")[0], (number, text))
    return recorded


def _poses(lines: Sequence[str], program: ParsedProgram, profile: Profile) -> Iterator[Finding]:
    """Errors for parts whose beads have another pose than their ;POSE: comment."""
    letters = (profile.machine.tilt.letter, profile.machine.turn.letter)
    beads = (program.kind == MoveKind.EXTRUDE) & (program.remarks.part > 0)[program.remark]
    for place in Lines.of(lines).beginning_with(";POSE:"):
        number, comment_pose = place + 1, POSE.match(lines[place])
        if comment_pose is None or (comment_pose[1], comment_pose[3]) != letters:
            continue
        row, wanted = int(np.searchsorted(program.line, number)), np.array([float(comment_pose[2]), float(comment_pose[4])])
        if not beads[row:].any():
            continue
        row += int(beads[row:].argmax())
        at = program.end[row, 3:]
        if np.abs(at - wanted).max() > LEVEL_DEG:
            message = (
                f"the part is printed at {letters[0]}{at[0]:.3f} {letters[1]}{at[1]:.3f}, "
                f"it was made for {letters[0]}{wanted[0]:.3f} {letters[1]}{wanted[1]:.3f}"
            )
            yield at_row(program, row, "error", "pose", message)


def _part_totals(program: ParsedProgram) -> Iterator[Finding]:
    """Errors for parts whose beads differ from their ;CONTENTS: comment, and for missing parts."""
    part, layer = program.remarks[:2]
    beads = (program.kind == MoveKind.EXTRUDE) & (part > 0)[program.remark] & ~program.rows_of_types(Kind.PURGE.value)
    laid = np.zeros(len(part), np.bool_)
    laid[program.remark[beads]] = True
    yield from _missing(program, set(part[laid].tolist()))
    for totals in program.part_totals:
        rows = np.flatnonzero(beads & (part == totals.part)[program.remark])
        if len(rows):
            yield from _of_part(program, rows, len(np.unique(layer[laid & (part == totals.part)])), totals)


def _missing(program: ParsedProgram, printed: set[int]) -> list[Finding]:
    """Error for parts that `;PART:1 of 3` announces but that have no beads."""
    absent = [index for index in range(1, program.announced + 1) if index not in printed]
    if not absent:
        return []
    line = int(program.line[-1]) if len(program.line) else 0
    names = f"part {absent[0]}" if len(absent) == 1 else f"parts {', '.join(map(str, absent[:10]))}"
    message = f"nothing of {names} is printed: the file announces {program.announced} parts, only {len(printed)} have beads"
    return [Finding("error", "missing", line, absent[0], 0, message)]


def _of_part(program: ParsedProgram, rows: NDArray[np.int64], layers: int, totals: PartTotals) -> Iterator[Finding]:
    """Differences of a part in layers, filament and position."""
    if layers != totals.layers:
        message = f"beads are laid in {layers} layers of part {totals.part}, the file states {totals.layers}"
        yield at_row(program, int(rows[-1]), "error", "contents", message)
    pushed = float(program.e_mm[rows].sum())
    if abs(pushed - totals.filament_mm) > max(FILAMENT_MM, FILAMENT_SHARE * totals.filament_mm):
        message = f"part {totals.part} pushes {pushed:.2f} mm of filament, the file states {totals.filament_mm:.2f} mm"
        yield at_row(program, int(rows[0]), "error", "contents", message)
    bounds = np.transpose([_extent(program, rows, axis) for axis in range(3)])
    apart = bounds - totals.bounds_mm
    if np.abs(apart).max() <= PLACE_MM:
        return
    side, axis = (int(v) for v in np.unravel_index(np.abs(apart).argmax(), apart.shape))
    ends = np.stack([program.start[rows, axis], program.end[rows, axis]])
    extreme = np.abs(ends - bounds[side, axis]).min(axis=0).argmin()
    shifted = bool(np.abs(apart[0] - apart[1]).max() <= PLACE_MM)  # both sides are shifted alike
    moved = f"lies {abs(apart[side, axis]):.2f} mm aside" if shifted else "reaches"
    laid, recorded = (f"{'XYZ'[axis]}{corners[side, axis]:.3f}" for corners in (bounds, totals.bounds_mm))
    message = f"part {totals.part} {moved} to {laid}, the file states {recorded} ({PLACE_MM:g} mm are allowed)"
    yield at_row(program, int(rows[0] if shifted else rows[extreme]), "error", "contents", message)


def _extent(program: ParsedProgram, rows: NDArray[np.int64], axis: int) -> tuple[float, float]:
    """Least and greatest position of an axis at the ends of some rows."""
    sides = [side[:, axis] for side in (program.start, program.end)]
    ends = [(side[rows[some]].min(), side[rows[some]].max()) for side in sides for some in pieces(len(rows))]
    return float(np.min(ends)), float(np.max(ends))

"""Calibration by a printed piece: readings of the pads of `demo:calibration` correct the axes of the user's profile."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from machine.cli.commands.measuring.calibrate import refuse_if_saved, save_tables, through, tilting_machine
from machine.cli.commands.measuring.questionnaire import Question, ask
from machine.cli.terminal.requests import CalibrationRequest
from machine.gcode.lines import GcodeFile
from machine.gcode.reader.parse import parse_gcode
from machine.notices import show
from machine.pipeline.embedded_profile import read_embedded_profile
from machine.pipeline.output import check_writable, refuse_to_overwrite, write_bytes
from machine.setup.calibration.fit import found_tables
from machine.setup.calibration.piece import (
    EXPECTED,
    Correction,
    Piece,
    correct,
    parse_pad,
    parse_readings,
    piece_page,
    read_piece,
    readings_text,
)
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.profile import load

FOUND = ("machine.turn.point_mm", "machine.tilt.point_mm", "machine.tilt.zero_deg")
INTRO = f"""Look at each pad with its holes above: one hole is pad 1. Below it and to its right, find the notch that continues
as a groove of the roof; count from the long one in the middle: 1, 2, ... to the right and up, -1, -2, ... to the left and down.
Then measure how high the pad's top stands over the roof beside it, mm. {EXPECTED.capitalize()}; b goes back.
"""


def write_page(request: CalibrationRequest, printed: Sequence[Path], html: Path) -> int:
    """Write the page on which the readings of a piece are entered and which shows the corrections at once."""
    check_writable(html)
    refuse_to_overwrite(html, request.replace)
    if len(printed) != 1:
        raise ProfileError(f"--html is the page of one piece: --printed is given {len(printed)} times")
    piece = _read(printed[0], tilting_machine(request))
    write_bytes(html, piece_page(piece, request.given.machine, printed[0].name))
    show(f"open {html} beside the printed piece\n")
    return 0


def correct_axes(request: CalibrationRequest, printed: Sequence[Path], readings: Sequence[str]) -> int:
    """Find the axes from the readings of one or several pieces, show the changes and save them."""
    machine = tilting_machine(request)
    if len(printed) != len(readings):
        raise ProfileError(
            f"--printed is given {len(printed)} times, --readings {len(readings)} times: the numbers must be equal"
        )
    pieces = [_read(path, machine) for path in printed]
    read_mm = np.array([parse_readings(text) for text in readings])
    return _settle(request, machine, correct(machine, pieces, read_mm), len(pieces))


def ask_for_readings(request: CalibrationRequest, printed: Path) -> int:
    """Ask for the readings of a piece pad by pad, then correct the axes and save them."""
    machine = tilting_machine(request)
    refuse_if_saved(request)
    piece = _read(printed, machine)
    sys.stdout.write(INTRO)
    read_mm = ask([_question(pad.number) for pad in piece.pads], "all pads were read")
    return _settle(request, machine, correct(machine, [piece], np.array([read_mm])), 1)


def _question(pad: int) -> Question[list[float]]:
    text = f"pad {pad} ({pad} hole{'s' * (pad > 1)}): right, up, height"
    return Question(text, lambda reply: parse_pad(reply, pad), lambda read_mm: readings_text(np.array([read_mm])))


def _read(path: Path, machine: Machine) -> Piece:
    """Read the piece that one of our programs prints. Raises ProfileError if it was made for another machine."""
    lines = GcodeFile(path).lines()
    profile, taken = read_embedded_profile(lines, load(), frozenset())
    if "machine" not in taken:
        raise ProfileError(
            f"{path} does not say for which machine it was made: a program of `export demo:calibration` is expected"
        )
    if profile.machine.name != machine.name:
        raise ProfileError(f"{path} was made for {profile.machine.name}: --machine names {machine.name}")
    return read_piece(parse_gcode(lines, profile.machine), profile.machine, str(path))


def _settle(request: CalibrationRequest, machine: Machine, correction: Correction, pieces: int) -> int:
    """Show a correction, and save it if it exceeds the uncertainty of the readings."""
    show(comparison(machine, correction))
    if correction.doubtful is not None and not request.force:
        piece, pad, way = correction.doubtful
        raise ProfileError(f"piece {piece}, pad {pad}: {way} does not fit the others: check it, or accept it with --force")
    if not correction.significant:
        show("no value changes by more than the uncertainty of the readings: the profile stays as it is\n")
        return 0
    source = f"tiltprint calibrate, {pieces} printed piece{'s' * (pieces > 1)}"
    save_tables(request, found_tables(machine, correction.machine, FOUND, source))
    return 0


def comparison(before: Machine, correction: Correction) -> str:
    """Lines that compare the result with the profile, with standard deviations and the largest residual."""
    after, sigma = correction.machine, correction.sigma.tolist()
    lines = [
        through("turn", before.turn, after.turn, max(sigma[:2])),
        through("tilt", before.tilt, after.tilt, max(sigma[2:4])),
        f"tilt {after.tilt.letter}: zero {after.tilt.zero_deg:.3f} (+-{sigma[4]:.3f} deg), was {before.tilt.zero_deg:g}",
        f"left over of the readings: {np.nanmax(np.abs(correction.left_mm)):.2f} mm at most",
    ]
    return "\n".join(lines) + "\n"

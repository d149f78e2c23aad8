"""The calibrate command: writes the program and the sheet, works out the numbers, saves them in the user's own profile."""

import sys
from collections.abc import Sequence
from pathlib import Path

from machine.app.calibrate_talk import asked
from machine.app.output import check_writable, write_bytes, write_lines
from machine.calibration.fit import Calibration, calibrate
from machine.calibration.program import calibration_lines, course
from machine.calibration.saved import found_tables, own_document
from machine.calibration.sheet import Sheet, read_sheet, sheet_text
from profiles.errors import OutputError, ProfileError
from profiles.machine import Machine
from profiles.places import own_folder
from profiles.profile import Profile, load_one
from profiles.toml import toml

MOST_OFF_MM = 0.5
MARK_HEIGHT_MM = 20.0


def write_program(
    name: str, profile: Profile, out: Path, mark_height_mm: float | None, mark_radius_mm: float | None, replace: bool
) -> int:
    """Write the G-code and, beside it, the sheet to fill in."""
    sheet = out.with_suffix(".toml")
    for file in (out, sheet):
        check_writable(file)
        _keep(file, replace)
    height = MARK_HEIGHT_MM if mark_height_mm is None else mark_height_mm
    touches = course(profile.machine, height, mark_radius_mm)
    write_lines(out, calibration_lines(profile, touches))
    write_bytes(sheet, sheet_text(name, profile.machine, touches).encode())
    radius = touches.mark_mm[0]
    sys.stdout.write(
        f"fix a pointed mark, {height:g} mm high, {radius:g} mm from the middle of the plate\n"
        f"run {out}: it takes the cold nozzle to the mark at {len(touches.poses)} poses\n"
        f"each time bring the tip onto the mark, note X Y Z in {sheet}, then go on\n"
        f"then: tiltprint calibrate --machine {name} --measured {sheet}\n"
    )
    return 0


def work_out(
    name: str, settings: Sequence[str], measured: Path, mark_height_mm: float | None, save: str | None, replace: bool, force: bool
) -> int:
    """Find signs, zeros and centres from a filled sheet, tell them and save them."""
    machine = _tilting(name, settings)
    sheet = read_sheet(measured, mark_height_mm)
    if sheet.machine not in (None, name):
        raise ProfileError(f"{measured} is a sheet of {sheet.machine}: --machine {sheet.machine} is expected, not {name}")
    found = calibrate(machine, sheet.touches, sheet.mark_height_mm, sheet.mark_angle_deg)
    sys.stdout.write(_told(machine, found, sheet.mark_angle_deg is not None))
    if found.rms_mm > MOST_OFF_MM and not force:
        raise ProfileError(
            f"{_off(found)}, at most {MOST_OFF_MM:g} mm is taken without --force: look at touch {found.worst} first"
        )
    _save(name, machine, found, sheet, save, replace)
    return 0


def talk(
    name: str, settings: Sequence[str], mark_height_mm: float | None, mark_radius_mm: float | None, save: str | None,
    replace: bool, force: bool,
) -> int:  # fmt: skip
    """Ask a person for the touches one by one, tell what follows from them, save it."""
    machine = _tilting(name, settings)
    _keep(own_document(save or Path(name).stem, name, {})[0], replace)
    best: list[Calibration] = []

    def judged(sheet: Sheet) -> str | int | None:
        try:
            found = calibrate(machine, sheet.touches, sheet.mark_height_mm, sheet.mark_angle_deg)
        except ProfileError as error:
            return str(error)
        sys.stdout.write(_told(machine, found, sheet.mark_angle_deg is not None))
        if found.rms_mm > MOST_OFF_MM and not force:
            sys.stdout.write(f"{_off(found)}, at most {MOST_OFF_MM:g} mm is taken without --force\n")
            return found.worst
        best.append(found)
        return None

    height = MARK_HEIGHT_MM if mark_height_mm is None else mark_height_mm
    sheet = asked(name, machine, height, mark_radius_mm, judged)
    _save(name, machine, best[-1], sheet, save, replace)
    return 0


def _tilting(name: str, settings: Sequence[str]) -> Machine:
    machine = load_one(name, settings).get("machine")
    if not isinstance(machine, Machine):
        raise ProfileError(f"{name} is not a machine profile")
    if not machine.tilts:
        raise ProfileError(f"{machine.name} has three axes: there is no rotary axis to calibrate")
    return machine


def _off(found: Calibration) -> str:
    return f"the touches are {found.rms_mm:.2f} mm off on average"


def _save(name: str, machine: Machine, found: Calibration, sheet: Sheet, save: str | None, replace: bool) -> None:
    """The found numbers in the user's own profile, and the file before beside it."""
    tables = found_tables(machine, found, sheet.mark_angle_deg is not None)
    file, document = own_document(save or Path(name).stem, name, tables)
    _keep(file, replace)
    own_folder("machine").mkdir(parents=True, exist_ok=True)
    if file.exists():
        write_bytes(file.with_suffix(".toml.before"), file.read_bytes())
    write_bytes(file, toml(document).encode())
    sys.stdout.write(f"saved: {file}; use it as --machine {file.stem}\n")


def _told(before: Machine, found: Calibration, zero_of_turn: bool) -> str:
    """The found numbers beside the profile's, and how far the touches are off."""
    lines = []
    for axis in ("tilt", "turn"):
        old, new = getattr(before, axis), getattr(found.machine, axis)
        sigma = max(value for key, value in found.sigma.items() if key.startswith(f"{axis}.point_mm"))
        place = " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", new.point_mm, strict=True))
        was = " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", old.point_mm, strict=True))
        lines.append(f"{axis} {new.letter}: through {place} (+-{sigma:.3f} mm), was {was}")
        lines.append(f"{axis} {new.letter}: sign {new.sign}, was {old.sign}")
        if axis == "tilt" or zero_of_turn:
            lines.append(f"{axis} {new.letter}: zero {new.zero_deg:.4f} deg, was {old.zero_deg:g}")
    lines.append(f"touches: {len(found.residuals_mm)}, {found.rms_mm:.4f} mm off on average, most at touch {found.worst}: ")
    return "\n".join(lines) + f"{max(found.residuals_mm):.4f} mm\n"


def _keep(file: Path, replace: bool) -> None:
    if file.exists() and not replace:
        raise OutputError(f"{file} exists: --replace writes over it, another name leaves it")

"""The calibrate command: writes program and sheet, evaluates the touches, and saves the result in the user's own profile."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from machine.cli.terminal.requests import CalibrationRequest
from machine.notices import show
from machine.pipeline.output import check_writable, refuse_to_overwrite, write_bytes, write_lines, write_own
from machine.setup.calibration.fit import Calibration, calibrate, fitted_tables
from machine.setup.calibration.program import calibration_lines, plan_touches
from machine.setup.calibration.sheet import Sheet, read_sheet, sheet_text
from machine.setup.files import own_profile
from profiles.axes import RotaryAxis
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.profile import Profile, load_one

MOST_OFF_MM = 0.5
MARK_HEIGHT_MM = 20.0


def write_program(request: CalibrationRequest, profile: Profile, out: Path) -> int:
    """Write the G-code, and beside it the sheet to fill in."""
    sheet = out.with_suffix(".toml")
    for file in (out, sheet):
        check_writable(file)
        refuse_to_overwrite(file, request.replace)
    height = mark_height_mm(request)
    touches = plan_touches(profile.machine, height, request.mark_radius_mm)
    write_lines(out, calibration_lines(profile, touches))
    write_bytes(sheet, sheet_text(request.given.machine, profile.machine, touches).encode())
    radius = touches.mark_mm[0]
    show(
        f"fix a pointed mark, {height:g} mm high, {radius:g} mm from the middle of the plate\n"
        f"run {out}: it takes the cold nozzle to the mark at {len(touches.poses)} poses\n"
        f"each time bring the tip onto the mark, note X Y Z in {sheet}, then continue\n"
        f"then: tiltprint calibrate --machine {request.given.machine} --measured {sheet}\n"
    )
    return 0


def evaluate_sheet(request: CalibrationRequest, measured: Path) -> int:
    """Evaluate a filled sheet: show and save signs, zeros and centres."""
    machine, name = tilting_machine(request), request.given.machine
    sheet = read_sheet(measured, request.mark_height_mm)
    if sheet.machine not in (None, name):
        raise ProfileError(f"{measured} is a sheet of {sheet.machine}: --machine {sheet.machine} is expected, not {name}")
    calibration, off = judged(request, machine, sheet)
    if off:
        raise ProfileError(f"{off}: check touch {calibration.worst} first")
    save_calibration(request, machine, calibration, sheet.mark_angle_deg is not None)
    return 0


def mark_height_mm(request: CalibrationRequest) -> float:
    """The requested mark height, or the default."""
    return MARK_HEIGHT_MM if request.mark_height_mm is None else request.mark_height_mm


def tilting_machine(request: CalibrationRequest) -> Machine:
    """The machine of a request. Raises ProfileError if it has no rotary axes."""
    machine = load_one(request.given.machine, request.given.settings).get("machine")
    if not isinstance(machine, Machine):
        raise ProfileError(f"{request.given.machine} is not a machine profile")
    if not machine.tilts:
        raise ProfileError(f"{machine.name} has three axes: there is no rotary axis to calibrate")
    return machine


def judged(request: CalibrationRequest, machine: Machine, sheet: Sheet) -> tuple[Calibration, str]:
    """Calibrate from the touches and show the result; returns it with the reason to reject it, "" if it is accepted."""
    calibration = calibrate(machine, sheet.touches, sheet.mark_height_mm, sheet.mark_angle_deg, request.directions)
    show(comparison(machine, calibration, sheet.mark_angle_deg is not None))
    if calibration.rms_mm <= MOST_OFF_MM or request.force:
        return calibration, ""
    off = f"the touches are {calibration.rms_mm:.2f} mm off on average"
    return calibration, f"{off}, at most {MOST_OFF_MM:g} mm is taken without --force"


def save_calibration(request: CalibrationRequest, machine: Machine, calibration: Calibration, zero_of_turn: bool = False) -> None:
    """Save the result in the user's own profile; a backup of the previous file stays beside it."""
    save_tables(request, fitted_tables(machine, calibration, zero_of_turn))


def refuse_if_saved(request: CalibrationRequest) -> None:
    """Raise OutputError early if the result could not be saved at the end."""
    name = Path(request.given.machine).stem
    refuse_to_overwrite(own_profile("machine", request.save or name, request.given.machine, {})[0], request.replace)


def save_tables(request: CalibrationRequest, tables: Mapping[str, Any]) -> None:
    """Save these tables in the user's own profile; a backup of the previous file stays beside it."""
    file, text = own_profile("machine", request.save or Path(request.given.machine).stem, request.given.machine, tables)
    write_own(file, text, request.replace)
    show(f"saved: {file}; use it as --machine {file.stem}\n")


def through(name: str, old: RotaryAxis, new: RotaryAxis, sigma_mm: float) -> str:
    """Line that compares an axis with the profile's, with its standard deviation."""
    point, was = (
        " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", axis.point_mm, strict=True)) for axis in (new, old)
    )
    return f"{name} {new.letter}: through {point} (+-{sigma_mm:.3f} mm), was {was}"


def comparison(before: Machine, calibration: Calibration, zero_of_turn: bool) -> str:
    """Lines that compare the result with the profile, and the residuals of the touches."""
    lines = []
    for axis in ("tilt", "turn"):
        old, new = getattr(before, axis), getattr(calibration.machine, axis)
        sigma = max(value for key, value in calibration.sigma.items() if key.startswith(f"{axis}.point_mm"))
        lines.append(through(axis, old, new, sigma))
        lines.append(f"{axis} {new.letter}: sign {new.sign}, was {old.sign}")
        if axis == "tilt" or zero_of_turn:
            lines.append(f"{axis} {new.letter}: zero {new.zero_deg:.4f} deg, was {old.zero_deg:g}")
        if calibration.directions:
            along = " ".join(f"{value:.5f}" for value in new.axis)
            was = " ".join(f"{value:g}" for value in old.axis)
            lines.append(f"{axis} {new.letter}: along {along} (+-{calibration.sigma[f'{axis}.axis']:.4f} deg), was {was}")
    touches, mean_mm = len(calibration.residuals_mm), calibration.rms_mm
    most = f"most at touch {calibration.worst}: {max(calibration.residuals_mm):.4f} mm"
    lines.append(f"touches: {touches}, {mean_mm:.4f} mm off on average, {most}")
    if calibration.directions and before.coordinates == "workpiece":
        lines.append(
            f"note: {before.dialect} follows the table as if its axes were straight: the directions count where "
            'coordinates = "table"'
        )
    return "\n".join(lines) + "\n"

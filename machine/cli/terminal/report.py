"""Tables that the commands print."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from machine.dryrun.dryrun import DryRun, summary
from machine.pipeline.requests import STDOUT
from machine.program import Alternative, Program
from machine.quantities import amount, duration, filament_g, minutes, newtons, percent, price_in_words, price_json
from profiles.messages import terminal_words, three_digits
from profiles.profile import Profile
from slicer.paths import SlicedPart

if TYPE_CHECKING:  # imported with the models that need them
    from machine.dryrun.agreement import Agreement
    from mdp.decomposition import Decomposition, FrontRow
    from mdp.joint import Joint

WIDEST = 100  # characters per line
NO_BREAK = "\u00a0"  # where wrap() breaks no line


def table(rows: list[list[str]]) -> str:
    """Rows as columns, the first left-aligned, the others right-aligned."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines) + "\n"


def parts_table(
    decomposition: "Decomposition", angle_deg: float = 45.0, count_platform_faces: bool = False, verbose: bool = False
) -> str:
    """The parts in print order, the area of each that needs support and what would need it uncut; then the front.

    angle_deg and count_platform_faces as the search had them. verbose: how much the search tried, too.
    """
    from machine.view.parts import risky_before_mm2

    rows = [["part", "tilt deg", "turn deg", "base mm", "volume mm³", "share", "needs support mm²", "uncut"]]
    for part in decomposition.parts:
        angles = [three_digits(value, 1) for value in (part.pose.tilt_deg, part.pose.turn_deg, part.base.offset_mm)]
        share = f"{percent(part.volume_mm3 / decomposition.volume_mm3, 1)} %"
        areas = [amount(part.risky_area_mm2, 1), amount(risky_before_mm2(part, angle_deg, count_platform_faces), 1)]
        rows.append([str(part.index), *angles, amount(part.volume_mm3, 0), share, *areas])
    front = "\n" + front_table(decomposition.front) if len(decomposition.front) > 1 else ""
    effort = f"{decomposition.candidates_evaluated} candidates in {amount(decomposition.search_s, 1)} s\n" if verbose else ""
    return table(rows) + effort + front + "\n"


def joints_table(joints: "Sequence[Joint]") -> str:
    """Table of joints with area, seam, contact, strength, and the weakest one; "" for a model in one piece."""
    from mdp.joint import weakest_of

    weakest = weakest_of(joints)
    if weakest is None:
        return ""
    sliced = any(joint.contact_share is not None for joint in joints)
    laid = ["contact %", "plastic / room %"] if sliced else []
    rows = [["joint of part", "area mm²", *laid, "seam mm", "arm mm", "breaks at N", "pulled off at N"]]
    for joint in joints:
        shares = [percent(joint.contact_share, 1), percent(joint.plastic_over_room)] if sliced else []
        lengths = [amount(joint.seam_mm, 0), amount(joint.arm_mm, 1)]
        forces = [newtons(joint.load_n), newtons(joint.tension_n)]
        rows.append([str(joint.part), amount(joint.area_mm2, 1), *shares, *lengths, *forces])
    sentence = f"weakest: part {weakest.part} breaks off at about {newtons(weakest.load_n)} N sideways at its tip"
    return table(rows) + sentence + "\n\n"


def front_table(front: "Sequence[FrontRow]") -> str:
    """The best decomposition for every number of parts, the chosen one marked and why; the totals if they decided."""
    summed = any(row.total_mm2 is not None for row in front)
    total = ["total mm²"] if summed else []
    rows = [["in parts", "needs support mm²", "seams mm", "stair-stepping mm²", "cost mm²", "time", "filament m", *total]]
    rows += [
        [
            str(row.parts),
            amount(row.support_area_mm2, 1),
            amount(row.seam_mm, 0),
            amount(row.stairs_mm2, 0),
            amount(row.cost_mm2, 1),
            *estimates(row),
            *(["-" if row.total_mm2 is None else amount(row.total_mm2, 1)] if summed else []),
        ]
        for row in front
    ]
    head, *lines = table(rows).splitlines()
    reasons = [f"  chosen {row.reason}" if row.chosen else row.flaw and f"  only on request: {row.flaw}" for row in front]
    return "\n".join([head, *(line + reason for line, reason in zip(lines, reasons, strict=True))]) + "\n"


def estimates(row: "FrontRow") -> list[str]:
    """Estimated time and metres of filament; dashes if unknown."""
    return [
        "-" if row.time_s is None else minutes(row.time_s),
        "-" if row.filament_mm is None else amount(row.filament_mm / 1000.0, 1),
    ]


def print_table(program: Program, profile: Profile) -> str:
    """Tables of the dry run, the cost, the interfaces, and part settings."""
    said = (
        run_table(program.run)
        + _costs_line(program, profile)
        + interfaces_line(program.interface_mm3)
        + pins_line(program.sliced)
    )
    return said + part_settings_lines(profile)


def print_price(program: Program, profile: Profile) -> dict[str, float | str]:
    """Cost of the filament for JSON; {} if the material has no price."""
    return price_json(_filament_mm(program), profile.material)


def _costs_line(program: Program, profile: Profile) -> str:
    filament_mm, material = _filament_mm(program), profile.material
    costs = price_in_words(filament_mm, material)
    return f"costs {costs} for {amount(filament_g(filament_mm, material), 1)} g of filament\n" if costs else ""


def _filament_mm(program: Program) -> float:
    return float(np.max(program.run.program.filament_mm, initial=0.0))


def verdict(run: DryRun) -> str:
    """Whether a program can be printed, with the number of its warnings or errors."""
    warnings = sum(finding.severity == "warning" for finding in run.findings)
    if not len(run.program.line):
        return "nothing to print"
    if run.errors:
        return f"not ready to print, {_count(len(run.errors), 'errors')}"
    return "ready to print" + (f", {_count(warnings, 'warnings')}" if warnings else "")


def written_line(files: Sequence[Path | None], verdict: str) -> str:
    """Which files a command has written, and what they are good for."""
    names = ", ".join(str(file) for file in files if file is not None and file != STDOUT)
    return f"wrote {names}: {verdict}\n" if names else f"{verdict}\n"


def run_table(run: DryRun) -> str:
    """Table of the dry run's figures and findings."""
    values = summary(run)
    lines = [
        f"time {duration(values['time_s'])}, filament {amount(values['filament_mm'] / 1000)} m, "
        f"{amount(values['extruded_mm3'] / 1000)} cm³",
        ", ".join(_count(values[key], key) for key in ("parts", "layers", "reorientations", "retractions"))
        + f", {amount(values['travel_mm'] / 1000)} m travel",
    ]
    if values["bounds_mm"]:
        low, high = (", ".join(f"{value:.1f}" for value in corner) for corner in values["bounds_mm"])
        lines.append(f"plastic from {low} to {high} mm (workpiece)")
    moved = [f"{axis} {reach[0]:.1f}..{reach[1]:.1f}" for axis, reach in values["axes"].items() if reach]
    lines.append("axes " + ", ".join(moved) if moved else "nothing moves")
    for finding in values["findings"]:
        where = f" (line{NO_BREAK}{finding['line']})" if finding["line"] else ""
        lines += _wrap_finding(finding["severity"], finding["message"] + where)
    return "\n".join(lines) + "\n"


def part_settings_lines(profile: Profile) -> str:
    """Lines with the settings of single parts."""
    lines = (wrap(f"part {settings.part} with {settings.in_words}", WIDEST, subsequent_indent="  ") for settings in profile.parts)
    return "".join(line + "\n" for several in lines for line in several)


def _wrap_finding(severity: str, message: str) -> list[str]:
    """A finding wrapped to lines with a hanging indent; profile keys are not broken."""
    indent = " " * len(f"{severity}: ")
    lines = wrap(
        terminal_words(message), WIDEST, initial_indent=f"{severity}: ", subsequent_indent=indent, break_long_words=False
    )
    return [line.replace(NO_BREAK, " ") for line in lines]


def interfaces_line(interface_mm3: Mapping[int, float]) -> str:
    """Line with the additional plastic of each interface; "" for a model in one piece."""
    if not interface_mm3:
        return ""
    of_parts = ", ".join(f"part{NO_BREAK}{index} {amount(mm3 / 1000)}" for index, mm3 in interface_mm3.items())
    sentence = f"interfaces take {amount(sum(interface_mm3.values()) / 1000)} cm³ that one piece would not: {of_parts}"
    lines = wrap(sentence, WIDEST, subsequent_indent="  ", break_long_words=False)
    return "\n".join(lines).replace(NO_BREAK, " ") + "\n"


def pins_line(sliced: Sequence[SlicedPart]) -> str:
    """Line with the number of pins per part; "" if there are none."""
    of_parts = ", ".join(f"part{NO_BREAK}{part.index} {part.pins}" for part in sliced if part.pins)
    return "\n".join(wrap(f"pins: {of_parts}", WIDEST)).replace(NO_BREAK, " ") + "\n" if of_parts else ""


def agreement_line(agreed: "Agreement") -> str:
    """Sentence on how well the plastic agrees with the model."""
    sentence = (
        f"the beads fill {percent(agreed.filled, 1)} % of the model; of their length {percent(agreed.outside, 2)} % lie outside "
        f"it by more than half a line ({amount(agreed.farthest_mm)} mm at the worst), {percent(agreed.unsupported, 2)} % hang in "
        f"air, and {percent(agreed.reported, 2)} % do so where the file marks an overhang or a bridge"
    )
    return "\n".join(wrap(sentence, WIDEST, subsequent_indent="  ")) + "\n"


def _count(number: int, things: str) -> str:
    return f"{number} {things if number != 1 else things.removesuffix('s')}"


def compare_table(alternatives: tuple[Alternative, ...]) -> str:
    """Table of the alternatives."""
    rows = [["print", "time", "filament", "mass", "support", "interfaces", "needs support"]]
    rows += [[way.name, *_costs(way), f"{amount(way.risky_mm2, 1)} mm²"] for way in alternatives]
    head, *lines = table(rows).splitlines()
    notes = [f"{way.name}: {note}" for way in alternatives for note in (way.orientation, way.message) if note]
    return "\n".join(["", head, *lines, *notes]) + "\n"


def _costs(alternative: Alternative) -> list[str]:
    """Time, filament, mass, support and interfaces; dashes if it cannot be printed."""
    if alternative.time_s is None:
        return ["-"] * 5
    filament_m, support_cm3 = (alternative.filament_mm or 0.0) / 1000, (alternative.support_mm3 or 0.0) / 1000
    mass = f"{amount(alternative.filament_g or 0.0, 1)} g"
    volumes = [f"{amount(support_cm3)} cm³", f"{amount(sum(alternative.interface_mm3.values()) / 1000)} cm³"]
    return [duration(alternative.time_s), f"{amount(filament_m)} m", mass, *volumes]

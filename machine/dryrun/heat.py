"""Heat: findings about temperatures, fans, flow and unmeasured numbers of the profile."""

from collections.abc import Iterable, Iterator
from math import inf, pi

import numpy as np

from machine.dryrun.findings import Finding, at_event, at_row, by_part, per_part, unless_own
from machine.gcode.commands import BED, COMMANDS, NOZZLE
from machine.gcode.line_text import to_ascii
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, fan_shares, pieces, temperatures
from machine.gcode.words import quote
from machine.quantities import amount
from mdp.mesh import Floats
from profiles.errors import counted
from profiles.machine import Machine
from profiles.messages import key_name, phrase
from profiles.profile import Profile
from slicer.paths import Kind

MELTING_C = 150.0
SLACK = 1.005
FAR_C = 35.0  # from a file's usual temperature: temperature towers stay within
SETTLED, FEWEST_STILL = 5, 2  # first layers of a part without fan, and fewest layers to report
QUICKER = 0.7
ROUNDING_MM = 3e-3  # both ends are rounded to a thousandth, and a dropped point gives its filament to the next


def findings(program: ParsedProgram, profile: Profile, own: bool) -> list[Finding]:
    """All findings about heat, fans, flow and the profile; own: the file's configuration names this material."""
    return [
        *_cold(program),
        *_left_on(program),
        *_temperature(program, profile, own),
        *_bed_off(program),
        *_fan(program, profile, own),
        *_flow(program, profile),
        *_profile(program, profile),
        *_unknown_commands(program),
        *_replaced_texts(program),
    ]


def waits(program: ParsedProgram, times_s: Floats, machine: Machine) -> list[tuple[int, float]]:
    """(line, seconds) of every wait for a hotter nozzle during the print; times_s: (n,) of the rows.

    The first one is left out: its length depends on how cold the machine was.
    """
    first = int(np.argmax(program.kind == MoveKind.EXTRUDE)) if len(program.kind) else 0
    waited, target_c, from_c, asked = [], 0.0, 0.0, 0
    for event in program.events:
        if event.code not in NOZZLE:
            continue
        if event.value != target_c:
            from_c, target_c, asked = target_c, event.value, event.row
        if COMMANDS[event.code].waits == "heat" and event.row > first:
            waited.append((event.line, machine.heating_s(target_c - from_c, float(times_s[asked : event.row].sum()))))
    return waited


def _cold(program: ParsedProgram) -> Iterable[Finding]:
    """Errors for filament pushed before the nozzle is heated, or with its heater off."""
    hot = np.zeros(len(program.line), dtype=np.bool_)
    heating = [e for e in program.events if e.code in NOZZLE]
    warm = False
    for event in heating:
        warm = event.value >= MELTING_C and (warm or COMMANDS[event.code].waits == "heat")
        hot[event.row :] = warm
    rows = np.flatnonzero((program.e_mm > 1e-9) & ~hot)
    if not len(rows):
        return []
    first = int(rows[0])
    waited_row = max((event.row for event in heating if event.row <= first), default=0)
    severity, unless = unless_own(program, waited_row, first)
    must = f"M109 S must come first and stay on{unless}"
    message = f"filament is pushed through a nozzle that is not hot (moves: {{count}}): {must}"
    return per_part(program, rows, program.e_mm[rows], message, code="cold-extrusion", severity=severity)


def _left_on(program: ParsedProgram) -> Iterator[Finding]:
    extruding = np.flatnonzero(program.e_mm > 1e-9)
    last = int(extruding[-1]) if len(extruding) else -1  # a macro in the middle of the print ends nothing
    for codes, name, off in ((NOZZLE, "nozzle", "M104 S0"), (BED, "bed", "M140 S0")):
        events = [e for e in program.events if e.code in codes]
        if events and events[-1].value > 0:
            severity, unless = unless_own(program, max(events[-1].row, last + 1), len(program.line))
            message = f"the {name} heater stays at {events[-1].value:g} °C after the end: {off} is missing{unless}"
            yield at_event(program, events[-1], severity, "heater-on", message)


def _temperature(program: ParsedProgram, profile: Profile, own: bool) -> list[Finding]:
    """In every part the first bead at another temperature than the material's, or far from the rest of the file's."""
    material, machine = profile.material, profile.machine
    hot_c = [event.value for event in program.events if event.code in NOZZLE and event.value >= MELTING_C]
    if own:
        own_c = (material.first_layer_nozzle_c, material.nozzle_c)
        hotter = max(profile.of_part(part).process.interface_temperature_add_c for part in (0, *program.parts))
        least, most = min(own_c) - 0.5, min(max(own_c) + hotter, machine.nozzle_limit_c) + 0.5
    else:  # whichever of them is usual
        least, most = max(hot_c, default=0.0) - FAR_C, min(min(hot_c, default=inf) + FAR_C, machine.nozzle_limit_c)
    if all(least <= target_c <= most for target_c in hot_c):
        return []
    wanted = temperatures(program, *NOZZLE)
    beads = (program.kind == MoveKind.EXTRUDE) & (wanted >= MELTING_C)
    if not beads.any():
        return []
    if not own:
        usual = min(float(np.median(wanted[beads])), machine.nozzle_limit_c)
        least, most = usual - FAR_C, min(usual + FAR_C, machine.nozzle_limit_c)
    message = f"the nozzle is at {{value}} °C, {max(least, 0.0):g} to {most:g} are expected (moves: {{count}})"
    cool, hot = (np.flatnonzero(beads & wrong) for wrong in (wanted < least, wanted > most))
    return [problem for rows in (cool, hot) for problem in per_part(program, rows, wanted[rows], message, code="temperature")]


def _bed_off(program: ParsedProgram) -> list[Finding]:
    """Warning for a bed switched off before the last bead: the print could come off the plate."""
    beads = np.flatnonzero(
        (program.kind == MoveKind.EXTRUDE) & (program.remarks.part + program.remarks.layer > 0)[program.remark]
    )
    switched_off = (event.code in BED and event.value <= 0.0 and event.row <= beads[-1] for event in program.events)
    if not len(beads) or not any(switched_off):
        return []
    bed = temperatures(program, *BED)
    if bed[beads[0]] <= 0.0:
        return []
    off = beads[bed[beads] <= 0.0]
    message = f"the bed is switched off while {len(off)} moves of the print are still to come"
    return [at_row(program, int(off[0]), "warning", "bed-off", message)] if len(off) else []


def _fan(program: ParsedProgram, profile: Profile, own: bool) -> Iterator[Finding]:
    """Warnings, one per part, for layers without fan in a file with fan in comparable layers.

    In tiltprint's files only the first layers have none. Other slicers set the fan by the duration of a layer, faster for quicker
    layers: there a layer is reported only if the fan is off once, in a layer quicker than most.
    """
    beads = (program.kind == MoveKind.EXTRUDE) & ~program.rows_of_types(Kind.PURGE.value)
    if not beads.any():
        return
    blows = fan_shares(program, profile.machine) > 0.0
    seconds, blown = np.zeros((2, program.layer_key_count))
    first = np.full(len(seconds), len(beads))
    for some in pieces(len(beads)):
        mine = some.start + np.flatnonzero(beads[some])
        layer, length = program.layer_keys(mine), program.ways_mm(mine)
        np.add.at(seconds, layer, length / np.maximum(program.feed[mine], 1e-9) * 60.0)
        np.add.at(blown, layer, length * blows[mine])
        np.minimum.at(first, layer, mine)
    at = np.flatnonzero(first < len(beads))
    rows = first[at]
    part = program.part[rows]
    _, begins, which = np.unique(part, return_index=True, return_inverse=True)
    begun = begins[which]
    settled = np.arange(len(at)) - begun >= SETTLED
    still = (blown[at] == 0.0) & settled
    if own:
        expected = min(profile.material.fan_least, profile.material.fan) > 0.0
        quiet = {index: _without_fan(index, profile) for index in set(part.tolist())}
        still &= expected & (np.arange(len(at)) - begun >= np.array([quiet[index] for index in part.tolist()]))
    else:
        quick = seconds[at] < QUICKER * float(np.median(seconds[at][blown[at] > 0.0])) if (blown > 0.0).any() else ~still
        once = np.count_nonzero(np.diff(still.astype(np.int8), prepend=0) > 0) == 1
        if not once or not quick[still].all():
            return
    for mine in by_part(program, rows[still]):
        if len(mine) < FEWEST_STILL:
            continue
        row = int(mine[0])
        message = f"no fan blows in layer {program.layer[row]}, where the file's other layers have one (layers: {len(mine)})"
        yield at_row(program, row, "error", "fan", message)


def _without_fan(part: int, profile: Profile) -> int:
    """Number of first layers of a part that are printed without fan by intent."""
    process, on_plate = profile.of_part(part).process, profile.material.fan_off_layers
    if part <= 1:
        return on_plate
    on_part = process.interface_layers if process.interface_fan == 0.0 else int(process.interface_first_layer_fan == 0.0)
    return max(on_part, on_plate) if process.complete_objects else on_part  # a part may begin another model


def _flow(program: ParsedProgram, profile: Profile) -> Iterable[Finding]:
    """Warnings for moves whose flow at the programmed speed exceeds the hot end's limit."""
    material = profile.material
    area, flow = pi * material.diameter_mm**2 / 4.0, np.empty(len(program.line))
    for some in pieces(len(flow)):
        flow[some] = program.e_mm[some] * area / (program.ways_mm(some) + ROUNDING_MM) * program.feed[some] / 60.0
    most = material.volumetric_limit_mm3_s
    message = f"the flow is {{value}} mm³/s, {material.name} allows {most:g} mm³/s (moves: {{count}})"
    much = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (flow > most * SLACK))
    return per_part(program, much, flow[much], message, code="flow", severity="warning")


def _profile(program: ParsedProgram, profile: Profile) -> Iterator[Finding]:
    machine = profile.machine
    if machine.uncalibrated:
        count = len(machine.uncalibrated)
        which = counted(count, "value is a guess", "values are guesses")
        names = ", ".join(map(key_name, machine.uncalibrated))
        see = phrase("calibration", "(see docs/calibration.md)")
        message = f"{machine.name} is not calibrated: {which} {see}: {names}"
        yield Finding("warning", "uncalibrated", 0, 0, 0, message)
    for line, part, area in program.unsupported:
        where = f", most of them in layer {area.layer}" if area.layer else ""
        why = f": {area.reason}" if area.reason else ""
        message = f"{amount(area.mm2, 1)} mm² of risky faces of part {part} could be given no support{where}{why}"
        yield Finding("warning", "unsupported", line, part, area.layer, message)


def _unknown_commands(program: ParsedProgram) -> list[Finding]:
    return [
        Finding("warning", "ignored", line, 0, 0, f"{code} is not known to the dry run and was ignored{_times(count)}")
        for code, (line, count) in program.ignored.items()
    ]


def _replaced_texts(program: ParsedProgram) -> Iterator[Finding]:
    """Warning for display texts with characters that a serial line does not carry; one finding for all."""
    if program.replaced:
        line, command = program.replaced[0]
        message = f"{quote(command)} is sent as {quote(to_ascii(command))}: a serial line carries ASCII only"
        yield Finding("warning", "text", line, 0, 0, f"{message}{_times(len(program.replaced))}")


def _times(count: int) -> str:
    return f", {count} times" if count > 1 else ""
